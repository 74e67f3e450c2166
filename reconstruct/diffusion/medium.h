#pragma once

#include <span>
#include <vector>

#include "base/block.h"
#include "base/material.h"
#include "reconstruct/diffusion/boundary.h"
#include "reconstruct/diffusion/fluence_solver.h"
#include "reconstruct/diffusion/source.h"

namespace opaline::reconstruct::diffusion {

/// One channel of a material as the diffusion equation sees it: kappa = 1 / (3 (sigma_a +
/// sigma_s')).
Medium make_medium(const Block& block,
                   const ChannelCoefficients& channel,
                   const Boundary& boundary);

/// Net flux out of a face, J_n = g_b (phi - S) + X, W/mm^2, one value a cell of the face (row-major
/// raster). `source` (S) and `escape` (X) are the face's SurfaceTerms, or empty on a face that is
/// not lit.
void net_flux(const Medium& medium,
              const Boundary& boundary,
              Face face,
              std::span<const double> phi,
              std::span<const double> source,
              std::span<const double> escape,
              std::span<double> flux);

/// dg_b of one face along a change, one value a cell of it: g_b^2 h / (2 kappa^2) dkappa.
std::vector<double> conductance_change(const Medium& medium,
                                       const Boundary& boundary,
                                       Face face,
                                       const MediumChange& change);

}  // namespace opaline::reconstruct::diffusion
