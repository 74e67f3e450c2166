#pragma once

#include "base/material.h"
#include "base/transport_responses.h"
#include "bench/inverse/element_mesh.h"

namespace opaline::bench {

/// Radiance on z_max for unit irradiance on each of patches x patches squares of z_min, by a discretisation that shares
/// nothing with the reconstruction's: trilinear finite elements, `refinement` of them a cell along each axis,
///
///   int kappa grad phi . grad v + int sigma_a phi v + int_surface phi v / (2 A) = int Q v,
///   Q = alpha' sigma_t' q e^(-int sigma_t')                                           (docs/physics.md)
///
/// with Q integrated exactly along the ray within each element, and the flux phi / (2 A) averaged over each cell of the
/// face. The model (A, camera equation) is the reconstruction's: what is told apart is discretisation and inversion.
/// Double precision, relative residual 1e-9 (bench/inverse/element_solver.h). Two million nodes take about a minute on
/// two cores, and 1.5 GB a core.
TransportResponses finite_element_responses(const Material& material,
                                            int patches,
                                            const Refinement& refinement);

}  // namespace opaline::bench
