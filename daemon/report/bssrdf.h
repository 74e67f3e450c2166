#pragma once

#include <functional>
#include <stop_token>

#include "base/material.h"
#include "base/result.h"
#include "base/transport_responses.h"
#include "daemon/report/error_sums.h"
#include "reconstruct/diffusion/fluence_solver.h"
#include "render/translucency.h"

namespace opaline::daemon {

/// The diffuse-BSSRDF error of a material, per channel, over every entry patch and every cell of
/// the seen face (Peers et al. 2006; Wang et al. 2008, section 6):
///
///   E = sum (R' - R)^2 / sum R^2
///
/// R is the stored light transport (radiance for unit irradiance on a patch), R' what the diffusion
/// equation gives in the material, on the material's grid. The variance of the stored transport
/// gives the part of E that is its noise.
/// `done` hears after each row of patches which share of them is done.
/// Errors: kInvalidArgument when the two do not describe the same block; kCancelled; the solver's.
Result<ChannelErrors> bssrdf_error(const Material& material,
                                   const TransportResponses& responses,
                                   const render::TranslucencyOptions& options,
                                   reconstruct::diffusion::FluenceSolver& solver,
                                   const std::function<void(double)>& done,
                                   std::stop_token stop);

}  // namespace opaline::daemon
