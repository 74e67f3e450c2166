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

LitMedium::LitMedium(const ChannelProblem& problem, const ChannelCoefficients& coefficients)
    : medium(diffusion::make_medium(problem.block, coefficients, problem.boundary)),
      light(medium, problem.boundary, problem.lit_face, problem.source) {
  for (const ChannelIllumination& i : problem.illuminations)
    surface.push_back(light.surface_terms(i.irradiance));
}

diffusion::FieldBatch LitMedium::right_sides(const ChannelProblem& problem) const {
  const auto count = static_cast<int>(problem.illuminations.size());
  diffusion::FieldBatch b(problem.block.cell_count(), count);
  for (int m = 0; m < count; ++m) {
    light.deposit(problem.illuminations[static_cast<std::size_t>(m)].irradiance,
                  {b.field(m), b.cells});
  }
  return b;
}

std::vector<std::vector<double>> radiance(const ChannelProblem& problem,
                                          const LitMedium& lit,
                                          const diffusion::FieldBatch& fluence) {
  const bool is_lit = problem.seen_face == problem.lit_face;
  std::vector<double> flux(problem.camera.size());
  std::vector<std::vector<double>> pictures(problem.illuminations.size());
  for (std::size_t m = 0; m < pictures.size(); ++m) {
    const Values source = is_lit ? Values(lit.surface[m].source) : Values();
    const Values escape = is_lit ? Values(lit.surface[m].escape) : Values();
    diffusion::net_flux(
        lit.medium, problem.boundary, problem.seen_face, field(fluence, m), source, escape, flux);
    for (std::size_t x = 0; x < flux.size(); ++x)
      pictures[m].push_back(problem.camera[x].radiance(is_lit ? source[x] : 0.0, flux[x]));
  }
  return pictures;
}

diffusion::FieldBatch adjoint_right_sides(const ChannelProblem& problem,
                                          const diffusion::Medium& medium,
                                          const FluxResiduals& residuals) {
  const Block& block = problem.block;
  const Face face = problem.seen_face;
  const double h = block.spacing()[axis_of(face)];
  diffusion::FieldBatch b(block.cell_count(), static_cast<int>(residuals.size()));
  for (int m = 0; m < b.count; ++m) {
    std::size_t f = 0;
    for (int row = 0; row < block.face_height(face); ++row) {
      for (int column = 0; column < block.face_width(face); ++column, ++f) {
        const std::size_t cell = block.cell_behind(face, column, row);
        b.field(m)[cell] = residuals[static_cast<std::size_t>(m)][f] *
                           problem.boundary.conductance(h, medium.diffusion[cell]);
      }
    }
  }
  return b;
}

diffusion::MediumGradient medium_gradient(const ChannelProblem& problem,
                                          const LitMedium& lit,
                                          const diffusion::FieldBatch& fluence,
                                          const diffusion::FieldBatch& adjoint,
                                          const FluxResiduals& residuals) {
  const bool lit_is_seen = problem.seen_face == problem.lit_face;
  MatrixGradient matrix(problem.block);
  diffusion::MediumGradient gradient(problem.block.cell_count());
  matrix.gather(fluence, adjoint);
  for (std::size_t m = 0; m < problem.illuminations.size(); ++m) {
    const auto phi = field(fluence, m);
    const auto psi = field(adjoint, m);
    for (const Face face : kFaces) {
      matrix.gather_face(face,
                         phi,
                         psi,
                         face == problem.lit_face ? Values(lit.surface[m].source) : Values(),
                         face == problem.seen_face ? Values(residuals[m]) : Values());
    }
    lit.light.add_gradient(problem.illuminations[m].irradiance,
                           psi,
                           lit_is_seen ? Values(residuals[m]) : Values(),
                           gradient);
  }
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
