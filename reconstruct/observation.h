#pragma once

#include <optional>
#include <span>
#include <vector>

#include "reconstruct/channel_problem.h"
#include "reconstruct/diffusion/camera_rays.h"
#include "reconstruct/diffusion/fluence_solver.h"
#include "reconstruct/diffusion/source.h"

namespace opaline::reconstruct {

/// One channel's medium with everything but its fluence that the observation depends on.
struct LitMedium {
  LitMedium(const ChannelProblem& problem, const ChannelCoefficients& coefficients);

  diffusion::Medium medium;
  diffusion::FaceSource light;
  std::vector<diffusion::SurfaceTerms> surface;  ///< per illumination
  std::optional<diffusion::CameraRays> rays;     ///< none with the surface's camera law

  /// The right-hand sides of K phi_m = b_m.
  diffusion::FieldBatch right_sides(const ChannelProblem& problem) const;
  void right_sides(const ChannelProblem& problem, diffusion::FieldBatch& b) const;
};

/// L per illumination on the seen face's cells, W/(mm^2 sr), from the fluence.
std::vector<std::vector<double>> radiance(const ChannelProblem& problem,
                                          const LitMedium& lit,
                                          const diffusion::FieldBatch& fluence);

/// The same along a change of the medium: dL from dphi, dX (per illumination, on the lit face) and what the observation itself
/// depends on.
std::vector<std::vector<double>> radiance_change(const ChannelProblem& problem,
                                                 const LitMedium& lit,
                                                 const diffusion::FieldBatch& fluence,
                                                 const diffusion::MediumChange& change,
                                                 const diffusion::FieldBatch& fluence_change,
                                                 const std::vector<std::vector<double>>& escape);

/// dJ/dL per illumination, one value a cell of the seen face.
using RadianceResiduals = std::vector<std::vector<double>>;

/// dJ/dJ_n, by the net flux out, and dJ/dPhi, by what a ray sees (diffusion/camera_rays.h), of dJ/dL.
std::vector<double> by_net_flux(const ChannelProblem& problem, std::span<const double> residual);
std::vector<double> by_ray(const ChannelProblem& problem, std::span<const double> residual);

/// The right-hand sides of the adjoint, K psi_m = dJ/dphi_m; K is its own adjoint. With the surface's camera law that is
/// sum_f r_f g_b e_i(f), r = dJ/dJ_n = flux_gain dJ/dL.
diffusion::FieldBatch adjoint_right_sides(const ChannelProblem& problem,
                                          const LitMedium& lit,
                                          const RadianceResiduals& residuals);
void adjoint_right_sides(const ChannelProblem& problem,
                         const LitMedium& lit,
                         const RadianceResiduals& residuals,
                         diffusion::FieldBatch& b);

}  // namespace opaline::reconstruct
