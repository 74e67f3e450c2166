#include "reconstruct/homogeneous_fit.h"

#include <Eigen/Core>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>

namespace opaline::reconstruct {
namespace {

using Logs = Eigen::Vector2d;  // log sigma_s', log sigma_a

constexpr int kMaxIterations = 20;
constexpr int kMaxDampings = 10;  // a factor of ten each
// Step of the central differences in a logarithm: truncation 1e-4 of them, the solves' tolerance 1e-3.
constexpr double kDifference = 1e-2;
constexpr double kConverged = 1e-3;  // change of the logarithms
constexpr std::size_t kFew = 4;      // illuminations that two numbers are found from

/// The same problem under at most kFew of its illuminations that have data.
ChannelProblem with_few_illuminations(const ChannelProblem& problem) {
  std::vector<const ChannelIllumination*> usable;
  for (const ChannelIllumination& i : problem.illuminations) {
    if (std::any_of(i.weight.begin(), i.weight.end(), [](double w) { return w > 0.0; })) {
      usable.push_back(&i);
    }
  }
  if (usable.size() <= kFew) return problem;
  ChannelProblem few = problem;
  few.illuminations.clear();
  for (std::size_t n = 0; n < kFew; ++n) {
    few.illuminations.push_back(*usable[n * (usable.size() - 1) / (kFew - 1)]);
  }
  return few;
}

class Fit {
 public:
  Fit(const ChannelProblem& problem,
      const InverseOptions& options,
      diffusion::FluenceSolver& solver,
      std::stop_token stop)
      : problem_(problem),
        objective_(problem, solver, {.tolerance = options.tolerance}),
        stop_(std::move(stop)) {
    lower_ = Logs(options.reduced_scattering.lowest, options.absorption.lowest).array().log();
    upper_ = Logs(options.reduced_scattering.highest, options.absorption.highest).array().log();
  }

  // sqrt(w) (L - L*), all data one after another.
  Result<Eigen::VectorXd> residuals(const Logs& logs) {
    const std::size_t cells = problem_.block.cell_count();
    auto radiance = objective_.predict({std::vector<double>(cells, std::exp(logs[1])),
                                        std::vector<double>(cells, std::exp(logs[0]))},
                                       stop_);
    if (!radiance) return radiance.error();
    const std::size_t width = problem_.camera.size();
    Eigen::VectorXd r(static_cast<Eigen::Index>(width * problem_.illuminations.size()));
    Eigen::Index n = 0;
    for (std::size_t m = 0; m < problem_.illuminations.size(); ++m) {
      const ChannelIllumination& data = problem_.illuminations[m];
      for (std::size_t x = 0; x < width; ++x) {
        r[n++] = std::sqrt(data.weight[x]) * ((*radiance)[m][x] - data.radiance[x]);
      }
    }
    return r;
  }

  Logs bounded(const Logs& logs) const { return logs.cwiseMax(lower_).cwiseMin(upper_); }

  // The best of a table: optical thickness 2 to 60, absorption 0.0003 to 0.1 of scattering.
  Result<Logs> start() {
    const auto size = problem_.block.size();
    const double thickness = std::min({size.x, size.y, size.z});
    Logs best = Logs::Zero();
    double least = std::numeric_limits<double>::infinity();
    for (const double depth : {2.0, 6.0, 18.0, 60.0}) {
      for (const double ratio : {3e-4, 3e-3, 3e-2, 1e-1}) {
        const Logs logs =
            bounded({std::log(depth / thickness), std::log(ratio * depth / thickness)});
        const auto r = residuals(logs);
        if (!r) return r.error();
        if (r->squaredNorm() < least) {
          least = r->squaredNorm();
          best = logs;
        }
      }
    }
    return best;
  }

  Result<HomogeneousFit> from(Logs logs) {
    auto r = residuals(logs);
    if (!r) return r.error();
    double damping = 1e-3;
    int iteration = 0;
    while (iteration < kMaxIterations) {
      ++iteration;
      const auto moved = step(logs, *r, damping);
      if (!moved) return moved.error();
      if (*moved < kConverged) break;
    }
    return HomogeneousFit{
        std::exp(logs[0]), std::exp(logs[1]), r->squaredNorm(), iteration, objective_.solves()};
  }

 private:
  Result<Eigen::MatrixX2d> jacobian(const Logs& logs, Eigen::Index size) {
    Eigen::MatrixX2d columns(size, 2);
    for (int i = 0; i < 2; ++i) {
      const Logs shift = kDifference * Logs::Unit(i);
      const auto above = residuals(logs + shift);
      if (!above) return above.error();
      const auto below = residuals(logs - shift);
      if (!below) return below.error();
      columns.col(i) = (*above - *below) / (2.0 * kDifference);
    }
    return columns;
  }

  // One Levenberg-Marquardt step; returns how far the logarithms moved, 0 when nothing lower was
  // found.
  Result<double> step(Logs& logs, Eigen::VectorXd& r, double& damping) {
    const auto slopes = jacobian(logs, r.size());
    if (!slopes) return slopes.error();
    const Eigen::Matrix2d normal = slopes->transpose() * *slopes;
    const Logs gradient = slopes->transpose() * r;
    for (int attempt = 0; attempt < kMaxDampings; ++attempt) {
      Eigen::Matrix2d damped = normal;
      damped.diagonal() *= 1.0 + damping;
      damped.diagonal().array() += 1e-12 * normal.trace();
      const Logs move = (-damped.inverse() * gradient).cwiseMax(-1.5).cwiseMin(1.5);
      const Logs next = bounded(logs + move);
      auto there = residuals(next);
      if (!there) return there.error();
      if (there->squaredNorm() >= r.squaredNorm()) {
        damping *= 10.0;
        continue;
      }
      const double moved = (next - logs).cwiseAbs().maxCoeff();
      logs = next;
      r = *std::move(there);
      damping = std::max(0.1 * damping, 1e-6);
      return moved;
    }
    return 0.0;
  }

  const ChannelProblem& problem_;
  Objective objective_;
  std::stop_token stop_;
  Logs lower_;
  Logs upper_;
};

}  // namespace

Result<HomogeneousFit> fit_homogeneous(const ChannelProblem& problem,
                                       const InverseOptions& options,
                                       diffusion::FluenceSolver& solver,
                                       std::stop_token stop) {
  const ChannelProblem few = with_few_illuminations(problem);
  Fit sketch(few, options, solver, stop);
  const auto start = sketch.start();
  if (!start) return start.error();
  auto fit = sketch.from(*start);
  if (!fit || options.max_iterations > 0) return fit;
  const Logs logs(std::log(fit->reduced_scattering), std::log(fit->absorption));
  auto last = Fit(problem, options, solver, std::move(stop)).from(logs);
  if (last) last->solves += fit->solves;
  return last;
}

}  // namespace opaline::reconstruct
