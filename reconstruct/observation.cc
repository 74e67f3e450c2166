#include "reconstruct/observation.h"

#include <span>

#include "reconstruct/diffusion/medium.h"

namespace opaline::reconstruct {
namespace {

using Values = std::span<const double>;

Values field(const diffusion::FieldBatch& batch, std::size_t m) {
  return {batch.field(static_cast<int>(m)), batch.cells};
}

template <class Visit>
void for_each_face_cell(const Block& block, Face face, const Visit& visit) {
  std::size_t f = 0;
  for (int row = 0; row < block.face_height(face); ++row)
    for (int column = 0; column < block.face_width(face); ++column, ++f)
      visit(f, block.cell_behind(face, column, row));
}

}  // namespace

LitMedium::LitMedium(const ChannelProblem& problem, const ChannelCoefficients& coefficients)
    : medium(diffusion::make_medium(problem.block, coefficients, problem.boundary)),
      light(medium, problem.boundary, problem.lit_face, problem.source) {
  for (const ChannelIllumination& i : problem.illuminations)
    surface.push_back(light.surface_terms(i.irradiance));
  if (!problem.rays.empty())
    rays.emplace(medium, problem.boundary, problem.seen_face, problem.rays);
}

diffusion::FieldBatch LitMedium::right_sides(const ChannelProblem& problem) const {
  diffusion::FieldBatch b(problem.block.cell_count(),
                          static_cast<int>(problem.illuminations.size()));
  right_sides(problem, b);
  return b;
}

void LitMedium::right_sides(const ChannelProblem& problem, diffusion::FieldBatch& b) const {
  b.clear();
  for (int m = 0; m < b.count; ++m) {
    light.deposit(problem.illuminations[static_cast<std::size_t>(m)].irradiance,
                  {b.field(m), b.cells});
  }
}

std::vector<std::vector<double>> radiance(const ChannelProblem& problem,
                                          const LitMedium& lit,
                                          const diffusion::FieldBatch& fluence) {
  const bool is_lit = problem.seen_face == problem.lit_face;
  std::vector<double> seen(problem.camera.size());
  std::vector<std::vector<double>> pictures(problem.illuminations.size());
  for (std::size_t m = 0; m < pictures.size(); ++m) {
    const Values source = is_lit ? Values(lit.surface[m].source) : Values();
    const Values escape = is_lit ? Values(lit.surface[m].escape) : Values();
    if (lit.rays) {
      lit.rays->gather(fluence.field(static_cast<int>(m)), source, seen);
    } else {
      diffusion::net_flux(
          lit.medium, problem.boundary, problem.seen_face, field(fluence, m), source, escape, seen);
    }
    for (std::size_t x = 0; x < seen.size(); ++x) {
      const diffusion::CameraEquation& camera = problem.camera[x];
      pictures[m].push_back(lit.rays ? camera.radiance(seen[x], is_lit ? escape[x] : 0.0)
                                     : camera.radiance(is_lit ? source[x] : 0.0, seen[x]));
    }
  }
  return pictures;
}

std::vector<std::vector<double>> radiance_change(const ChannelProblem& problem,
                                                 const LitMedium& lit,
                                                 const diffusion::FieldBatch& fluence,
                                                 const diffusion::MediumChange& change,
                                                 const diffusion::FieldBatch& fluence_change,
                                                 const std::vector<std::vector<double>>& escape) {
  const bool is_lit = problem.seen_face == problem.lit_face;
  const auto conductance =
      conductance_change(lit.medium, problem.boundary, problem.seen_face, change);
  std::vector<double> seen(problem.camera.size());
  std::vector<std::vector<double>> pictures(problem.illuminations.size());
  for (std::size_t m = 0; m < pictures.size(); ++m) {
    const Values source = is_lit ? Values(lit.surface[m].source) : Values();
    const auto phi = field(fluence, m);
    const auto d_phi = field(fluence_change, m);
    if (lit.rays) {
      lit.rays->gather(d_phi.data(), {}, seen);
      lit.rays->add_tangent(phi.data(), source, change, seen);
    } else {
      diffusion::net_flux(lit.medium, problem.boundary, problem.seen_face, d_phi, {}, {}, seen);
      for_each_face_cell(problem.block, problem.seen_face, [&](std::size_t f, std::size_t cell) {
        seen[f] += conductance[f] * (phi[cell] - (is_lit ? source[f] : 0.0));
      });
    }
    for (std::size_t x = 0; x < seen.size(); ++x) {
      const diffusion::CameraEquation& camera = problem.camera[x];
      const double escaped = is_lit ? escape[m][x] : 0.0;
      pictures[m].push_back(lit.rays ? camera.radiance(seen[x], escaped)
                                     : camera.radiance(0.0, seen[x] + escaped));
    }
  }
  return pictures;
}

diffusion::FieldBatch adjoint_right_sides(const ChannelProblem& problem,
                                          const LitMedium& lit,
                                          const RadianceResiduals& residuals) {
  diffusion::FieldBatch b(problem.block.cell_count(), static_cast<int>(residuals.size()));
  adjoint_right_sides(problem, lit, residuals, b);
  return b;
}

void adjoint_right_sides(const ChannelProblem& problem,
                         const LitMedium& lit,
                         const RadianceResiduals& residuals,
                         diffusion::FieldBatch& b) {
  const Block& block = problem.block;
  const double h = block.spacing()[axis_of(problem.seen_face)];
  b.clear();
  for (int m = 0; m < b.count; ++m) {
    const auto& residual = residuals[static_cast<std::size_t>(m)];
    if (lit.rays) {
      lit.rays->scatter(by_ray(problem, residual), b.field(m));
      continue;
    }
    const auto by_flux = by_net_flux(problem, residual);
    for_each_face_cell(block, problem.seen_face, [&](std::size_t f, std::size_t cell) {
      b.field(m)[cell] = by_flux[f] * problem.boundary.conductance(h, lit.medium.diffusion[cell]);
    });
  }
}

std::vector<double> by_net_flux(const ChannelProblem& problem, std::span<const double> residual) {
  std::vector<double> r(residual.begin(), residual.end());
  for (std::size_t x = 0; x < r.size(); ++x) r[x] *= problem.camera[x].flux_gain;
  return r;
}
std::vector<double> by_ray(const ChannelProblem& problem, std::span<const double> residual) {
  std::vector<double> r(residual.begin(), residual.end());
  for (std::size_t x = 0; x < r.size(); ++x) r[x] *= problem.camera[x].source_gain;
  return r;
}

}  // namespace opaline::reconstruct
