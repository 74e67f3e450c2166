#include "reconstruct/adjoint.h"

#include "reconstruct/diffusion/medium.h"
#include "reconstruct/gradient.h"

namespace opaline::reconstruct {
namespace {

using Values = std::span<const double>;

Values field(const diffusion::FieldBatch& batch, std::size_t m) {
  return {batch.field(static_cast<int>(m)), batch.cells};
}

}  // namespace

diffusion::MediumGradient medium_gradient(const ChannelProblem& problem,
                                          const LitMedium& lit,
                                          const diffusion::FieldBatch& fluence,
                                          const diffusion::FieldBatch& adjoint,
                                          const RadianceResiduals& residuals) {
  const bool lit_is_seen = problem.seen_face == problem.lit_face;
  std::vector<std::vector<double>> along_rays;
  std::vector<std::vector<double>> sources;
  MatrixGradient matrix(problem.block);
  diffusion::MediumGradient gradient(problem.block.cell_count());
  matrix.gather(fluence, adjoint);
  for (std::size_t m = 0; m < problem.illuminations.size(); ++m) {
    const auto phi = field(fluence, m);
    const auto psi = field(adjoint, m);
    const auto by_flux = by_net_flux(problem, residuals[m]);
    for (const Face face : kFaces) {
      matrix.gather_face(face,
                         phi,
                         psi,
                         face == problem.lit_face ? Values(lit.surface[m].source) : Values(),
                         face == problem.seen_face && !lit.rays ? Values(by_flux) : Values());
    }
    lit.light.add_gradient(problem.illuminations[m].irradiance,
                           psi,
                           lit_is_seen ? Values(by_flux) : Values(),
                           gradient);
    if (!lit.rays) continue;
    along_rays.push_back(by_ray(problem, residuals[m]));
    sources.push_back(lit_is_seen ? lit.surface[m].source : std::vector<double>());
  }
  if (lit.rays) lit.rays->add_gradient(fluence, sources, along_rays, gradient);
  matrix.add_to(lit.medium, problem.boundary, gradient);
  return gradient;
}

std::vector<double> to_parameter_gradient(const ChannelCoefficients& c,
                                          const diffusion::MediumGradient& logs) {
  const std::size_t cells = c.absorption.size();
  std::vector<double> gradient(2 * cells);
  for (std::size_t i = 0; i < cells; ++i) {
    const double mean_free_path = 1.0 / (c.absorption[i] + c.reduced_scattering[i]);
    gradient[i] = -c.reduced_scattering[i] * mean_free_path * logs.diffusion[i];
    gradient[cells + i] = logs.absorption[i] - c.absorption[i] * mean_free_path * logs.diffusion[i];
  }
  return gradient;
}

}  // namespace opaline::reconstruct
