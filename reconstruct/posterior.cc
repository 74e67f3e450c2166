#include "reconstruct/posterior.h"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "reconstruct/information.h"
#include "reconstruct/resample.h"

namespace opaline::reconstruct {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kLeastAmplitude = 0.02;
constexpr double kLargestAmplitude = 1.5;
constexpr int kEvidences = 10;  // of the search: the amplitude to 4 %

VectorXd deviations(const Information& info, const PriorOptions& k, const PriorOptions& a) {
  VectorXd d(info.size());
  d << info.diffusion().deviations(k), info.absorption().deviations(a);
  return d;
}

// 1 + S A^T R^-1 A S.
Eigen::LLT<MatrixXd> whitened(const NormalEquations& normal, const VectorXd& d) {
  MatrixXd p = d.asDiagonal() * normal.hessian * d.asDiagonal();
  p.diagonal().array() += 1.0;
  return Eigen::LLT<MatrixXd>(p);
}

double evidence(const NormalEquations& normal, const VectorXd& d) {
  const auto factors = whitened(normal, d);
  const VectorXd h = d.cwiseProduct(normal.gradient);
  return -0.5 * (normal.norm - h.dot(factors.solve(h))) -
         factors.matrixLLT().diagonal().array().log().sum();
}

// Golden section over log amplitude.
double likeliest_amplitude(const Information& info,
                           const NormalEquations& normal,
                           PriorOptions diffusion,
                           const PriorOptions& absorption) {
  const auto at = [&](double log_amplitude) {
    diffusion.amplitude = std::exp(log_amplitude);
    return evidence(normal, deviations(info, diffusion, absorption));
  };
  constexpr double kGolden = 0.6180339887498949;
  double low = std::log(kLeastAmplitude);
  double high = std::log(kLargestAmplitude);
  double a = high - kGolden * (high - low);
  double b = low + kGolden * (high - low);
  double at_a = at(a);
  double at_b = at(b);
  for (int n = 2; n < kEvidences; ++n) {
    if (at_a > at_b) {
      high = std::exchange(b, a);
      at_b = at_a;
      a = high - kGolden * (high - low);
      at_a = at(a);
    } else {
      low = std::exchange(a, b);
      at_a = at_b;
      b = low + kGolden * (high - low);
      at_b = at(b);
    }
  }
  return std::exp(at_a > at_b ? a : b);
}

struct Variances {  // per cell of the block
  std::vector<double> diffusion;
  std::vector<double> absorption;
  std::vector<double> both;  // covariance
};

LogCoefficients logarithms(const ChannelCoefficients& c) {
  LogCoefficients u;
  for (std::size_t i = 0; i < c.absorption.size(); ++i) {
    u.diffusion.push_back(-std::log(3.0 * (c.absorption[i] + c.reduced_scattering[i])));
    u.absorption.push_back(std::log(c.absorption[i]));
  }
  return u;
}

// mean + F y - u.
std::vector<double> shift_to(const Information& info,
                             const Block& block,
                             const CosinePrior& basis,
                             const VectorXd& y,
                             std::vector<double> u) {
  const double mean = std::accumulate(u.begin(), u.end(), 0.0) / static_cast<double>(u.size());
  const VectorXd coarse = basis.values() * y;
  const auto fine =
      interpolate_cells(info.grid(), block, {coarse.data(), coarse.data() + coarse.size()});
  for (std::size_t i = 0; i < u.size(); ++i) u[i] = mean + fine[i] - u[i];
  return u;
}

// log sigma_s' = log(1 / (3 kappa) - sigma_a): d = -(by_diffusion dlog kappa + by_absorption dlog sigma_a).
struct ScatteringSlopes {
  ScatteringSlopes(const ChannelCoefficients& c, std::size_t i)
      : by_diffusion((c.absorption[i] + c.reduced_scattering[i]) / c.reduced_scattering[i]),
        by_absorption(c.absorption[i] / c.reduced_scattering[i]) {}
  double by_diffusion;
  double by_absorption;
};

LogCoefficients shift_to(const Information& info,
                         const Block& block,
                         const VectorXd& y,
                         const ChannelCoefficients& estimate) {
  LogCoefficients at = logarithms(estimate);
  const CosinePrior& k = info.diffusion();
  const CosinePrior& a = info.absorption();
  LogCoefficients shift;
  shift.diffusion = shift_to(info, block, k, y.head(k.size()), std::move(at.diffusion));
  shift.absorption = shift_to(info, block, a, y.tail(a.size()), std::move(at.absorption));
  for (std::size_t i = 0; i < shift.diffusion.size(); ++i) {
    const ScatteringSlopes slopes(estimate, i);
    shift.reduced_scattering.push_back(-slopes.by_diffusion * shift.diffusion[i] -
                                       slopes.by_absorption * shift.absorption[i]);
  }
  return shift;
}

// From those about the mean to those about a point that it was shifted from.
void add_shift(const LogCoefficients& shift, Variances& v) {
  for (std::size_t i = 0; i < v.both.size(); ++i) {
    v.diffusion[i] += shift.diffusion[i] * shift.diffusion[i];
    v.absorption[i] += shift.absorption[i] * shift.absorption[i];
    v.both[i] += shift.diffusion[i] * shift.absorption[i];
  }
}

// diag(F C G^T).
VectorXd diagonal(const MatrixXd& f, const MatrixXd& c, const MatrixXd& g) {
  return (f * c).cwiseProduct(g).rowwise().sum();
}

std::vector<double> less(double prior, std::vector<double> reduction) {
  for (double& v : reduction) v = std::max(prior - v, 1e-8 * prior);
  return reduction;
}

double variance(const PriorOptions& prior) {
  return prior.level * prior.level + prior.amplitude * prior.amplitude;
}

Variances variances(const Information& info,
                    const Block& block,
                    const MatrixXd& covariance,
                    const PriorOptions& k,
                    const PriorOptions& a) {
  const auto on_block = [&](const VectorXd& v) {
    return interpolate_cells(info.grid(), block, {v.data(), v.data() + v.size()});
  };
  const MatrixXd fk = info.diffusion().values() * info.diffusion().deviations(k).asDiagonal();
  const MatrixXd fa = info.absorption().values() * info.absorption().deviations(a).asDiagonal();
  const Index nk = fk.cols();
  const Index na = fa.cols();
  const VectorXd less_k =
      fk.cwiseAbs2().rowwise().sum() - diagonal(fk, covariance.topLeftCorner(nk, nk), fk);
  const VectorXd less_a =
      fa.cwiseAbs2().rowwise().sum() - diagonal(fa, covariance.bottomRightCorner(na, na), fa);
  return {less(variance(k), on_block(less_k)),
          less(variance(a), on_block(less_a)),
          on_block(diagonal(fk, covariance.topRightCorner(nk, na), fa))};
}

LogCoefficients roots(const Variances& v, const ChannelCoefficients& c) {
  LogCoefficients out;
  for (std::size_t i = 0; i < v.diffusion.size(); ++i) {
    const auto [by_k, by_a] = ScatteringSlopes(c, i);
    const double scattering = by_k * by_k * v.diffusion[i] + by_a * by_a * v.absorption[i] +
                              2.0 * by_k * by_a * v.both[i];
    out.diffusion.push_back(std::sqrt(v.diffusion[i]));
    out.absorption.push_back(std::sqrt(v.absorption[i]));
    out.reduced_scattering.push_back(std::sqrt(std::max(scattering, 0.0)));
  }
  return out;
}

Result<void> check_prior(const char* name, const PriorOptions& p) {
  if (p.level >= 0.0 && p.level < 10.0 && p.amplitude > 0.0 && p.amplitude < 10.0) return ok();
  return invalid_argument(fmt::format(
      "posterior {}: level {}, amplitude {}; expected 0 to 10, the amplitude more than 0",
      name,
      p.level,
      p.amplitude));
}

Result<ChannelPosterior> posterior_and(const ChannelProblem& problem,
                                       const ChannelProblem* held_out,
                                       diffusion::FluenceSolver& solver,
                                       const ChannelCoefficients& estimate,
                                       const PosteriorOptions& options,
                                       std::stop_token stop) {
  if (auto valid = validate(options); !valid) return valid.error();
  Information info(problem, solver, options);
  if (auto gathered = info.gather(estimate, stop); !gathered) return gathered.error();
  const NormalEquations normal = info.normal_equations(options.discrepancy);
  ChannelPosterior out;
  out.diffusion = options.diffusion;
  out.absorption = options.absorption;
  if (options.find_amplitude)
    out.diffusion.amplitude = likeliest_amplitude(info, normal, out.diffusion, out.absorption);
  const VectorXd d = deviations(info, out.diffusion, out.absorption);
  const auto factors = whitened(normal, d);
  const MatrixXd covariance = factors.solve(MatrixXd::Identity(info.size(), info.size()));
  const Index nk = info.diffusion().size();
  const Index na = info.absorption().size();
  out.determined_diffusion = static_cast<double>(nk) - covariance.diagonal().head(nk).sum();
  out.determined_absorption = static_cast<double>(na) - covariance.diagonal().tail(na).sum();
  const VectorXd y = d.cwiseProduct(factors.solve(d.cwiseProduct(normal.gradient)));
  out.shift = shift_to(info, problem.block, y, estimate);
  Variances about = variances(info, problem.block, covariance, out.diffusion, out.absorption);
  add_shift(out.shift, about);
  out.deviation = roots(about, estimate);
  out.grid = info.grid();
  out.solves = info.solves();
  if (held_out == nullptr) return out;
  Information unseen(*held_out, solver, options);
  if (auto gathered = unseen.gather(estimate, std::move(stop)); !gathered) return gathered.error();
  const MatrixXd products = d.asDiagonal() * unseen.normal_equations(0.0).hessian * d.asDiagonal();
  out.held_out_variance =
      MatrixXd(products.selfadjointView<Eigen::Lower>()).cwiseProduct(covariance).sum();
  out.solves += unseen.solves();
  return out;
}

}  // namespace

Result<void> validate(const PosteriorOptions& o) {
  if (auto good = check_prior("diffusion", o.diffusion); !good) return good;
  if (auto good = check_prior("absorption", o.absorption); !good) return good;
  if (!(o.length_mm > 0.0) || !std::isfinite(o.length_mm))
    return invalid_argument(fmt::format("posterior: length_mm = {}; expected > 0", o.length_mm));
  if (!(o.tolerance > 0.0))
    return invalid_argument(fmt::format("posterior: tolerance = {}; expected > 0", o.tolerance));
  if (!(o.discrepancy >= 0.0) || !std::isfinite(o.discrepancy))
    return invalid_argument(
        fmt::format("posterior: discrepancy = {}; expected >= 0", o.discrepancy));
  if (o.cells < 1 || o.diffusion_modes < 1 || o.absorption_modes < 1)
    return invalid_argument("posterior: cells and modes; expected >= 1");
  return ok();
}

Result<ChannelPosterior> posterior(const ChannelProblem& problem,
                                   diffusion::FluenceSolver& solver,
                                   const ChannelCoefficients& estimate,
                                   const PosteriorOptions& options,
                                   std::stop_token stop) {
  return posterior_and(problem, nullptr, solver, estimate, options, std::move(stop));
}

Result<ChannelPosterior> posterior(const ChannelProblem& problem,
                                   const ChannelProblem& held_out,
                                   diffusion::FluenceSolver& solver,
                                   const ChannelCoefficients& estimate,
                                   const PosteriorOptions& options,
                                   std::stop_token stop) {
  return posterior_and(problem, &held_out, solver, estimate, options, std::move(stop));
}
}  // namespace opaline::reconstruct
