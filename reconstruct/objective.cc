#include "reconstruct/objective.h"

#include <algorithm>
#include <cmath>

#include "base/ensure.h"
#include "reconstruct/diffusion/medium.h"
#include "reconstruct/solve_check.h"

namespace opaline::reconstruct {

using diffusion::FieldBatch;
using diffusion::MediumGradient;

namespace {

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
      regularizer_(problem.block, settings.regularization, settings.regularizer) {
  start_afresh();
}

void Objective::start_afresh() {
  lit_.reset();
  const auto count = static_cast<int>(problem_.illuminations.size());
  fluence_ = FieldBatch(problem_.block.cell_count(), count);
  adjoint_ = FieldBatch(problem_.block.cell_count(), count);
  right_sides_ = FieldBatch(problem_.block.cell_count(), count);
}

Result<void> Objective::solve(const FieldBatch& b, FieldBatch& x, std::stop_token stop) {
  const auto summary = solver_.solve(b, x, {.tolerance = settings_.tolerance}, stop);
  if (!summary) return summary.error();
  solves_ += b.count;
  return check_useful(*summary);
}

Result<void> Objective::solve_forward(const ChannelCoefficients& coefficients,
                                      std::stop_token stop) {
  lit_.emplace(problem_, coefficients);
  if (auto prepared = solver_.prepare(lit_->medium); !prepared) return prepared;
  lit_->right_sides(problem_, right_sides_);
  return solve(right_sides_, fluence_, stop);
}

// Fills radiance_ from the fluence.
void Objective::observe() { radiance_ = radiance(problem_, *lit_, fluence_); }

// Fills radiance_residual_ with dJ/dL = w (L - L*); returns chi-squared.
double Objective::residuals() {
  double chi_squared = 0.0;
  radiance_residual_.resize(radiance_.size());
  for (std::size_t m = 0; m < radiance_.size(); ++m) {
    const ChannelIllumination& data = problem_.illuminations[m];
    radiance_residual_[m].resize(radiance_[m].size());
    for (std::size_t x = 0; x < radiance_[m].size(); ++x) {
      const double misfit = radiance_[m][x] - data.radiance[x];
      chi_squared += data.weight[x] * misfit * misfit;
      radiance_residual_[m][x] = data.weight[x] * misfit;
    }
  }
  return chi_squared;
}

Result<void> Objective::solve_adjoint(std::stop_token stop) {
  adjoint_right_sides(problem_, *lit_, radiance_residual_, right_sides_);
  return solve(right_sides_, adjoint_, stop);
}

void Objective::regularize(const ChannelCoefficients& c,
                           Evaluation& out,
                           MediumGradient& logs) const {
  out.regularization = regularizer_.add(logarithms(lit_->medium.diffusion), logs.diffusion) +
                       regularizer_.add(logarithms(c.absorption), logs.absorption);
  out.value += out.regularization;
}

void Objective::add_gradient(const ChannelCoefficients& c, Evaluation& out) const {
  MediumGradient gradient =
      medium_gradient(problem_, *lit_, fluence_, adjoint_, radiance_residual_);
  for (std::size_t i = 0; i < problem_.block.cell_count(); ++i) {
    gradient.diffusion[i] *= lit_->medium.diffusion[i];
    gradient.absorption[i] *= c.absorption[i];
  }
  regularize(c, out, gradient);
  out.gradient = to_parameter_gradient(c, gradient);
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

Result<Tangent> Objective::tangent(std::span<const double> p, std::stop_token stop) {
  ENSURE(p.size() == parameter_count());
  const ChannelCoefficients c = to_coefficients(p);
  const auto medium = diffusion::make_medium(problem_.block, c, problem_.boundary);
  if (lit_ && lit_->medium.diffusion == medium.diffusion &&
      lit_->medium.absorption == medium.absorption) {
    return Tangent(problem_, solver_, c, fluence_, settings_.tolerance);
  }
  auto made = Tangent::at(problem_, solver_, c, settings_.tolerance, std::move(stop));
  if (made) solves_ += made->solves();
  return made;
}

Result<std::vector<double>> Objective::hessian_product(Tangent& tangent,
                                                       std::span<const double> v,
                                                       const std::stop_token& stop) {
  const long before = tangent.solves();
  const auto moved = tangent.apply(v, stop);
  if (!moved) return moved.error();
  auto product = tangent.apply_adjoint(*moved, stop);
  if (!product) return product;
  solves_ += tangent.solves() - before;
  add_regularizer_product(tangent.coefficients(), v, *product);
  return product;
}

// dlog kappa = -3 kappa (sigma_s' v_s + sigma_a v_a), dlog sigma_a = v_a.
void Objective::add_regularizer_product(const ChannelCoefficients& c,
                                        std::span<const double> v,
                                        std::span<double> product) const {
  const std::size_t cells = problem_.block.cell_count();
  std::vector<double> kappa_move(cells);
  std::vector<double> log_kappa(cells);
  for (std::size_t i = 0; i < cells; ++i) {
    const double extinction = c.reduced_scattering[i] + c.absorption[i];
    log_kappa[i] = -std::log(3.0 * extinction);
    kappa_move[i] = -(c.reduced_scattering[i] * v[i] + c.absorption[i] * v[cells + i]) / extinction;
  }
  MediumGradient logs(cells);
  regularizer_.add_product(log_kappa, kappa_move, logs.diffusion);
  regularizer_.add_product(logarithms(c.absorption), v.subspan(cells), logs.absorption);
  const std::vector<double> by_parameter = to_parameter_gradient(c, logs);
  for (std::size_t i = 0; i < product.size(); ++i) product[i] += by_parameter[i];
}

}  // namespace opaline::reconstruct
