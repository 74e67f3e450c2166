#pragma once

#include <span>
#include <vector>

#include "base/block.h"
#include "reconstruct/diffusion/boundary.h"
#include "reconstruct/diffusion/camera_rays.h"
#include "reconstruct/diffusion/fluence_solver.h"

namespace opaline::reconstruct::diffusion {

/// What a camera sees of a face that a projector lights perpendicularly, beyond what CameraRays sees of the diffuse
/// fluence: light scattered once, and the layer under the light of which diffusion knows nothing. It is as in a half space
/// lit all over, of the medium within a mean free path under each cell:
///
///   L = F_t / (4 pi eta^2) (Phi + Phi_lit),   Phi_lit = q (Phi_T - Phi_D)
///
/// Phi_T: transport (diffusion/half_space.h); Phi_D: CameraRays on the discrete diffusion of that half space in cells of
/// the same height, and (2 A + 3 mu_i) X for what leaves the first cell at once (SurfaceTerms::escape), so that what the
/// grid does to both is mended, too. The ray law alone is 6 to 10 % low under uniform light. Within a mean free path of a
/// patch's edge it is as coarse as a step.
///
/// Shapes: `q`, transmitted irradiance, and the answer Phi_lit, W/mm^2, one a cell of the face (row-major raster). Collimated
/// source with centroid deposit.
std::vector<double> lit_surface(const Medium& medium,
                                const Boundary& boundary,
                                double ior,
                                Face face,
                                std::span<const CameraRay> rays,
                                std::span<const double> q);

}  // namespace opaline::reconstruct::diffusion
