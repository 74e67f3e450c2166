#include "reconstruct/objective.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "base/ensure.h"
#include "reconstruct/diffusion/medium.h"
#include "reconstruct/diffusion/source.h"
#include "reconstruct/gradient.h"

namespace opaline::reconstruct {

using diffusion::FieldBatch;
using diffusion::MediumGradient;

namespace {

constexpr double kUselessResidual =
    1e-3;  // a solve that stays above this says nothing about the medium

std::span<const double> field(const FieldBatch& batch, std::size_t m) {
  return {batch.field(static_cast<int>(m)), batch.cells};
}

std::vector<double> logarithms(const std::vector<double>& values) {
  std::vector<double> logs(values.size());
  std::transform(values.begin(), values.end(), logs.begin(), [](double v) { return std::log(v); });
  return logs;
}

}  // namespace

std::vector<double> to_parameters(const ChannelCoefficients& c) {
  std::vector<double> p = logarithms(c.reduced_scattering);
  const std::vector<double> absorption = logarithms(c.absorption);
  p.insert(p.end(), absorption.begin(), absorption.end());
  return p;
}

ChannelCoefficients to_coefficients(std::span<const double> p) {
  const std::size_t cells = p.size() / 2;
  ChannelCoefficients c{std::vector<double>(cells), std::vector<double>(cells)};
  for (std::size_t i = 0; i < cells; ++i) {
    c.reduced_scattering[i] = std::exp(p[i]);
    c.absorption[i] = std::exp(p[cells + i]);
  }
  return c;
}

Objective::Objective(const ChannelProblem& problem,
                     diffusion::FluenceSolver& solver,
                     Settings settings)
    : problem_(problem),
      solver_(solver),
      settings_(settings),
      regularizer_(problem.block, settings.regularization) {
  start_afresh();
}

void Objective::start_afresh() {
  const auto count = static_cast<int>(problem_.illuminations.size());
  fluence_ = FieldBatch(problem_.block.cell_count(), count);
  adjoint_ = FieldBatch(problem_.block.cell_count(), count);
}

Result<void> Objective::solve(const FieldBatch& b, FieldBatch& x, std::stop_token stop) {
  const auto summary = solver_.solve(b, x, {.tolerance = settings_.tolerance}, stop);
  if (!summary) return summary.error();
  solves_ += b.count;
  if (summary->termination == diffusion::Termination::kCancelled)
    return cancelled("diffusion solve");
  if (!(summary->relative_residual < kUselessResidual)) {
    return internal_error(
        fmt::format("diffusion solve stopped at a relative residual of {:.1e}: {}",
                    summary->relative_residual,
                    summary->message));
  }
  return ok();
}

Result<void> Objective::solve_forward(const ChannelCoefficients& coefficients,
                                      std::stop_token stop) {
  medium_ = diffusion::make_medium(problem_.block, coefficients, problem_.boundary);
  if (auto prepared = solver_.prepare(medium_); !prepared) return prepared;
  surface_.clear();
  const auto& light =
      light_.emplace(medium_, problem_.boundary, problem_.lit_face, problem_.source);
  FieldBatch b(fluence_.cells, fluence_.count);
  for (int m = 0; m < b.count; ++m) {
    const auto& q = problem_.illuminations[static_cast<std::size_t>(m)].irradiance;
    light.deposit(q, {b.field(m), b.cells});
    surface_.push_back(light.surface_terms(q));
  }
  return solve(b, fluence_, stop);
}

// Fills radiance_ from the fluence.
void Objective::observe() {
  const bool lit = problem_.seen_face == problem_.lit_face;
  std::vector<double> flux(problem_.camera.size());
  radiance_.resize(problem_.illuminations.size());
  for (std::size_t m = 0; m < radiance_.size(); ++m) {
    const auto source =
        lit ? std::span<const double>(surface_[m].source) : std::span<const double>();
    const auto escape =
        lit ? std::span<const double>(surface_[m].escape) : std::span<const double>();
    diffusion::net_flux(
        medium_, problem_.boundary, problem_.seen_face, field(fluence_, m), source, escape, flux);
    radiance_[m].resize(flux.size());
    for (std::size_t x = 0; x < flux.size(); ++x) {
      radiance_[m][x] = problem_.camera[x].radiance(lit ? source[x] : 0.0, flux[x]);
    }
  }
}

// Fills flux_residual_ with r = w (L - L*) dL/dJ_n; returns chi-squared.
double Objective::residuals() {
  double chi_squared = 0.0;
  flux_residual_.resize(radiance_.size());
  for (std::size_t m = 0; m < radiance_.size(); ++m) {
    const ChannelIllumination& data = problem_.illuminations[m];
    flux_residual_[m].resize(radiance_[m].size());
    for (std::size_t x = 0; x < radiance_[m].size(); ++x) {
      const double misfit = radiance_[m][x] - data.radiance[x];
      chi_squared += data.weight[x] * misfit * misfit;
      flux_residual_[m][x] = data.weight[x] * misfit * problem_.camera[x].flux_gain;
    }
  }
  return chi_squared;
}

// K psi = sum_f r_f g_b e_i(f); K is its own adjoint.
Result<void> Objective::solve_adjoint(std::stop_token stop) {
  const Block& block = problem_.block;
  const Face face = problem_.seen_face;
  const double h = block.spacing()[axis_of(face)];
  FieldBatch b(adjoint_.cells, adjoint_.count);
  for (int m = 0; m < b.count; ++m) {
    std::size_t f = 0;
    for (int row = 0; row < block.face_height(face); ++row) {
      for (int column = 0; column < block.face_width(face); ++column, ++f) {
        const std::size_t cell = block.cell_behind(face, column, row);
        b.field(m)[cell] = flux_residual_[static_cast<std::size_t>(m)][f] *
                           problem_.boundary.conductance(h, medium_.diffusion[cell]);
      }
    }
  }
  return solve(b, adjoint_, stop);
}

void Objective::regularize(const ChannelCoefficients& c,
                           Evaluation& out,
                           MediumGradient& logs) const {
  out.regularization = regularizer_.add(logarithms(medium_.diffusion), logs.diffusion) +
                       regularizer_.add(logarithms(c.absorption), logs.absorption);
  out.value += out.regularization;
}

// d/dlog sigma_s' = -(sigma_s' / sigma_t') d/dlog kappa,
// d/dlog sigma_a  = d/dlog sigma_a at fixed kappa - (sigma_a / sigma_t') d/dlog kappa
void Objective::add_gradient(const ChannelCoefficients& c, Evaluation& out) const {
  const std::size_t cells = problem_.block.cell_count();
  MatrixGradient matrix(problem_.block);
  MediumGradient gradient(cells);
  for (std::size_t m = 0; m < problem_.illuminations.size(); ++m) {
    const auto phi = field(fluence_, m);
    const auto psi = field(adjoint_, m);
    matrix.gather(phi, psi);
    for (const Face face : kFaces) {
      using Values = std::span<const double>;
      matrix.gather_face(face,
                         phi,
                         psi,
                         face == problem_.lit_face ? Values(surface_[m].source) : Values(),
                         face == problem_.seen_face ? Values(flux_residual_[m]) : Values());
    }
    const bool lit = problem_.seen_face == problem_.lit_face;
    light_->add_gradient(
        problem_.illuminations[m].irradiance,
        psi,
        lit ? std::span<const double>(flux_residual_[m]) : std::span<const double>(),
        gradient);
  }
  matrix.add_to(medium_, problem_.boundary, gradient);
  for (std::size_t i = 0; i < cells; ++i) {
    gradient.diffusion[i] *= medium_.diffusion[i];
    gradient.absorption[i] *= c.absorption[i];
  }
  regularize(c, out, gradient);
  out.gradient.resize(2 * cells);
  for (std::size_t i = 0; i < cells; ++i) {
    const double mean_free_path = 3.0 * medium_.diffusion[i];
    out.gradient[i] = -c.reduced_scattering[i] * mean_free_path * gradient.diffusion[i];
    out.gradient[cells + i] =
        gradient.absorption[i] - c.absorption[i] * mean_free_path * gradient.diffusion[i];
  }
}

Result<Evaluation> Objective::evaluate(std::span<const double> p, std::stop_token stop) {
  ENSURE(p.size() == parameter_count());
  const ChannelCoefficients coefficients = to_coefficients(p);
  if (auto solved = solve_forward(coefficients, stop); !solved) return solved.error();
  observe();
  Evaluation out;
  out.chi_squared = residuals();
  out.value = 0.5 * out.chi_squared;
  if (auto solved = solve_adjoint(stop); !solved) return solved.error().in("adjoint");
  add_gradient(coefficients, out);
  return out;
}

Result<double> Objective::value(std::span<const double> p, std::stop_token stop) {
  ENSURE(p.size() == parameter_count());
  const ChannelCoefficients coefficients = to_coefficients(p);
  if (auto solved = solve_forward(coefficients, stop); !solved) return solved.error();
  observe();
  Evaluation out;
  out.value = 0.5 * residuals();
  MediumGradient unused(problem_.block.cell_count());
  regularize(coefficients, out, unused);
  return out.value;
}

Result<std::vector<std::vector<double>>> Objective::predict(const ChannelCoefficients& coefficients,
                                                            std::stop_token stop) {
  if (auto solved = solve_forward(coefficients, stop); !solved) return solved.error();
  observe();
  return radiance_;
}

}  // namespace opaline::reconstruct
