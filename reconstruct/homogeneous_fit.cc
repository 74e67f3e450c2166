#include "reconstruct/homogeneous_fit.h"

#include <Eigen/Core>
#include <Eigen/LU>
#include <Eigen/QR>
#include <algorithm>
#include <array>
#include <cmath>
#include <initializer_list>
#include <limits>
#include <optional>

#include "reconstruct/coarse_grid.h"
#include "reconstruct/illumination_subset.h"

namespace opaline::reconstruct {
namespace {

using Logs = Eigen::Vector2d;  // log sigma_s', log sigma_a

Logs logs_of(double reduced_scattering, double absorption) {
  return {std::log(reduced_scattering), std::log(absorption)};
}

Logs logs_of(const HomogeneousFit& fit) { return logs_of(fit.reduced_scattering, fit.absorption); }

constexpr int kMaxIterations = 20;
constexpr int kMaxDampings = 10;  // a factor of ten each
// Step of the central differences in a logarithm: truncation 1e-4 of them, the solves' tolerance 1e-3.
constexpr double kDifference = 1e-2;
constexpr double kConverged = 1e-3;  // change of the logarithms
constexpr double kNoMove =
    2e-3;                        // of them: where it leads nowhere the solves' tolerance is reached
constexpr std::size_t kFew = 4;  // illuminations that two numbers are found from
constexpr double kUnexplained = 0.25;  // of the data's power
constexpr double kMuchLower = 0.25;    // times
constexpr double kFarAbove = 2.0;      // times
constexpr double kSameEnd = 0.05;      // apart, of the logarithms
constexpr double kOtherEnd = 0.2;      // of log sigma_s': absorption alone may lie in a flat valley
constexpr int kScoutIterations = 4;
constexpr std::size_t kSketchCells = 20000;  // the largest grid that a start is sought on
constexpr double kSecant =
    0.3;  // a move of the logarithms after which the slopes are worth keeping
constexpr double kTwoSided95 = 1.959964;  // of the normal distribution

// sqrt(w) dL/d(log sigma_s', sigma_a), a row a datum.
using Slopes = Eigen::MatrixX2d;

// Mean square of the data, as the model's error has it.
double square_level(const ChannelIllumination& data) {
  double sum = 0.0;
  double count = 0.0;
  for (std::size_t x = 0; x < data.weight.size(); ++x) {
    if (!(data.weight[x] > 0.0)) continue;
    sum += data.radiance[x] * data.radiance[x];
    count += 1.0;
  }
  return count > 0.0 ? sum / count : 0.0;
}

// J^T W V W J + sum_k (J^T W e_k) (J^T W e_k)^T of the header; `slopes` is sqrt(W) J.
Eigen::Matrix2d score_covariance(const ChannelProblem& problem,
                                 const Slopes& slopes,
                                 double model_error) {
  Eigen::Matrix2d noise = Eigen::Matrix2d::Zero();
  Eigen::Vector2d in_proportion = Eigen::Vector2d::Zero();
  Eigen::Vector2d everywhere = Eigen::Vector2d::Zero();
  Eigen::Index n = 0;
  for (const ChannelIllumination& data : problem.illuminations) {
    const double level = square_level(data);
    for (std::size_t x = 0; x < data.weight.size(); ++x, ++n) {
      if (!(data.weight[x] > 0.0)) continue;
      const double l = data.radiance[x];
      const Eigen::Vector2d slope = slopes.row(n);
      const double model = model_error * model_error * (l * l + level);
      noise += std::max(1.0 - data.weight[x] * model, 0.0) * slope * slope.transpose();
      in_proportion += std::sqrt(data.weight[x]) * model_error * l * slope;
      everywhere += std::sqrt(data.weight[x] * level) * model_error * slope;
    }
  }
  return noise + in_proportion * in_proportion.transpose() + everywhere * everywhere.transpose();
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

  // From the best absorption, 0.0003 to 0.1 of scattering, of each optical thickness, the lowest end: neither the table nor
  // the first steps tell which that is. A way that joins an earlier one's end, or stays far above it, is left.
  Result<HomogeneousFit> from_best_of(std::initializer_list<double> depths) {
    std::vector<HomogeneousFit> ends{unexplained()};  // the best of them first
    for (const double depth : depths) {
      const auto start = best_absorption(depth);
      if (!start) return start.error();
      auto end = from(*start, ends.front());
      if (!end) return end;
      const bool lowest = end->chi_squared < ends.front().chi_squared;
      ends.insert(lowest ? ends.begin() : ends.end(), *std::move(end));
    }
    HomogeneousFit best = ends.front();
    best.rivals = rivals(std::move(ends));
    best.solves = objective_.solves();
    return best;
  }

  bool explains(const HomogeneousFit& fit) const {
    return fit.chi_squared < kUnexplained * power();
  }

  // The chi^2 of darkness.
  double power() const {
    double sum = 0.0;
    for (const ChannelIllumination& data : problem_.illuminations)
      for (std::size_t x = 0; x < data.weight.size(); ++x)
        sum += data.weight[x] * data.radiance[x] * data.radiance[x];
    return sum;
  }

  Result<HomogeneousFit> from(Logs logs, const HomogeneousFit& rival = unexplained()) {
    auto r = residuals(logs);
    if (!r) return r.error();
    State at{logs, *std::move(r)};
    int iteration = 0;
    while (iteration < kMaxIterations) {
      ++iteration;
      const auto moved = step(at);
      if (!moved) return moved.error();
      if (*moved < kConverged || loses(at, rival, iteration)) break;
      if (*moved > kSecant) at.slopes.reset();
    }
    return HomogeneousFit{.reduced_scattering = std::exp(at.logs[0]),
                          .absorption = std::exp(at.logs[1]),
                          .chi_squared = at.r.squaredNorm(),
                          .iterations = iteration,
                          .solves = objective_.solves(),
                          .reduced_scattering_interval = {},
                          .absorption_interval = {}};
  }

  Result<void> add_intervals(HomogeneousFit& fit, double model_error) {
    const auto slopes = slopes_at(fit);
    if (!slopes) return slopes.error();
    const Eigen::Matrix2d inverse =
        (slopes->transpose() * *slopes).completeOrthogonalDecomposition().pseudoInverse();
    const Eigen::Matrix2d covariance =
        inverse * score_covariance(problem_, *slopes, model_error) * inverse;
    const double factor = std::exp(kTwoSided95 * std::sqrt(covariance(0, 0)));
    const double reach = kTwoSided95 * std::sqrt(covariance(1, 1));
    fit.reduced_scattering_interval = {fit.reduced_scattering / factor,
                                       fit.reduced_scattering * factor};
    fit.absorption_interval = {std::max(fit.absorption - reach, 0.0), fit.absorption + reach};
    fit.solves = objective_.solves();
    return ok();
  }

 private:
  // Of the first one, which is the best.
  static std::vector<StartCoefficients> rivals(std::vector<HomogeneousFit> ends) {
    std::ranges::sort(ends, {}, &HomogeneousFit::chi_squared);
    std::vector<Logs> known{logs_of(ends.front())};
    std::vector<StartCoefficients> found;
    for (const HomogeneousFit& end : ends) {
      if (!(end.chi_squared <= kFarAbove * ends.front().chi_squared)) break;
      const bool other = std::ranges::all_of(
          known, [&end](const Logs& k) { return std::abs(k[0] - logs_of(end)[0]) > kOtherEnd; });
      if (!other) continue;
      known.push_back(logs_of(end));
      found.push_back({end.reduced_scattering, end.absorption});
    }
    return found;
  }

  // By central differences; one-sided in absorption where there is no room below.
  Result<Slopes> slopes_at(const HomogeneousFit& fit) {
    const Logs logs = logs_of(fit);
    Slopes slopes(static_cast<Eigen::Index>(problem_.camera.size() * problem_.illuminations.size()),
                  2);
    const double step =
        std::max(kDifference * fit.absorption, kDifference * kDifference * fit.reduced_scattering);
    const double below = fit.absorption > 2.0 * step ? fit.absorption - step : fit.absorption;
    const std::array<std::array<Logs, 2>, 2> ends{
        {{logs + kDifference * Logs::Unit(0), logs - kDifference * Logs::Unit(0)},
         {Logs(logs[0], std::log(fit.absorption + step)), Logs(logs[0], std::log(below))}}};
    const std::array<double, 2> apart{2.0 * kDifference, fit.absorption + step - below};
    for (std::size_t i = 0; i < 2; ++i) {
      const auto above = residuals(ends[i][0]);
      if (!above) return above.error();
      const auto under = residuals(ends[i][1]);
      if (!under) return under.error();
      slopes.col(static_cast<Eigen::Index>(i)) = (*above - *under) / apart[i];
    }
    return slopes;
  }

  Logs of_thickness(double depth, double ratio) const {
    const auto size = problem_.block.size();
    const double thickness = std::min({size.x, size.y, size.z});
    return bounded({std::log(depth / thickness), std::log(ratio * depth / thickness)});
  }

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

  Result<Logs> best_absorption(double depth) {
    Logs best = Logs::Zero();
    double least = std::numeric_limits<double>::infinity();
    for (const double ratio : {3e-4, 3e-3, 3e-2, 1e-1}) {
      const Logs logs = of_thickness(depth, ratio);
      const auto r = residuals(logs);
      if (!r) return r.error();
      if (r->squaredNorm() >= least) continue;
      least = r->squaredNorm();
      best = logs;
    }
    return best;
  }

  // A point of the way, and the slopes there where they are known.
  struct State {
    Logs logs;
    Eigen::VectorXd r;
    double damping = 1e-3;
    std::optional<Slopes> slopes = std::nullopt;
  };

  static HomogeneousFit unexplained() {
    HomogeneousFit none;
    none.chi_squared = std::numeric_limits<double>::infinity();
    return none;
  }

  static bool loses(const State& at, const HomogeneousFit& rival, int iteration) {
    if (!std::isfinite(rival.chi_squared)) return false;
    if ((at.logs - logs_of(rival)).cwiseAbs().maxCoeff() < kSameEnd) return true;
    return iteration >= kScoutIterations && at.r.squaredNorm() > kFarAbove * rival.chi_squared;
  }

  // One Levenberg-Marquardt step; returns how far the logarithms moved, 0 when nothing lower was
  // found. Slopes that are kept are those of before with what the step itself has shown (Broyden 1965, Math. Comput.
  // 19, Eq. 4.5); where they lead nowhere they are taken afresh.
  Result<double> step(State& at) {
    const bool kept = at.slopes.has_value();
    if (!kept) {
      auto slopes = jacobian(at.logs, at.r.size());
      if (!slopes) return slopes.error();
      at.slopes = *std::move(slopes);
    }
    const Eigen::Matrix2d normal = at.slopes->transpose() * *at.slopes;
    const Logs gradient = at.slopes->transpose() * at.r;
    for (int attempt = 0; attempt < (kept ? 1 : kMaxDampings); ++attempt) {
      Eigen::Matrix2d damped = normal;
      damped.diagonal() *= 1.0 + at.damping;
      damped.diagonal().array() += 1e-12 * normal.trace();
      const Logs move = (-damped.inverse() * gradient).cwiseMax(-1.5).cwiseMin(1.5);
      const Logs next = bounded(at.logs + move);
      auto there = residuals(next);
      if (!there) return there.error();
      if (there->squaredNorm() < at.r.squaredNorm()) return take(at, next, *std::move(there));
      if (move.cwiseAbs().maxCoeff() < kNoMove) return 0.0;
      at.damping *= 10.0;
    }
    if (!kept) return 0.0;
    at.slopes.reset();
    return step(at);
  }

  static double take(State& at, const Logs& next, Eigen::VectorXd there) {
    const Logs moved = next - at.logs;
    const Eigen::VectorXd unforeseen = there - at.r - *at.slopes * moved;
    *at.slopes += unforeseen * moved.transpose() / moved.squaredNorm();
    at.logs = next;
    at.r = std::move(there);
    at.damping = std::max(0.1 * at.damping, 1e-6);
    return moved.cwiseAbs().maxCoeff();
  }

  const ChannelProblem& problem_;
  Objective objective_;
  std::stop_token stop_;
  Logs lower_;
  Logs upper_;
};

// A thin slab that absorbs and a thick one that does not are two minima. Diffusion hardly holds in the thin one, so that it has
// to be much lower: where neither explains the pictures (a coarse grid, veins) it is not to be had for a better fit.
// Through a slab less light comes the more it scatters, through a film more: what no slab explains may be a film.
Result<HomogeneousFit> sketched(Fit& sketch) {
  auto fit = sketch.from_best_of({6.0, 18.0, 60.0});
  if (!fit) return fit;
  auto thin = sketch.from_best_of({2.0});
  if (!thin) return thin;
  if (thin->chi_squared < kMuchLower * fit->chi_squared) fit = thin;
  fit->solves = thin->solves;  // counted by the sketch
  if (sketch.explains(*fit)) return fit;
  auto thinner = sketch.from_best_of({0.02, 0.1, 0.5});
  if (!thinner || thinner->chi_squared < fit->chi_squared) return thinner;
  fit->solves = thinner->solves;  // counted by the sketch
  return fit;
}

// From a grid of half as many cells along each axis, where there are many, and so on down.
Result<HomogeneousFit> fit_down_to(const ChannelProblem& problem,
                                   const InverseOptions& options,
                                   diffusion::FluenceSolver& solver,
                                   const std::stop_token& stop) {
  Fit fit(problem, options, solver, stop);
  if (const auto& start = problem.start)
    return fit.from(fit.bounded(logs_of(start->reduced_scattering, start->absorption)));
  const auto coarse =
      problem.block.cell_count() > kSketchCells ? coarser_block(problem.block) : std::nullopt;
  if (!coarse) return sketched(fit);
  auto below = fit_down_to(coarsened(problem, *coarse), options, solver, stop);
  if (!below) return below;
  auto found = fit.from(logs_of(*below));
  if (found) found->rivals = std::move(below->rivals);
  if (found && !fit.explains(*found)) found = sketched(fit);
  if (found) found->solves += solves_on_finer(*coarse, problem.block, below->solves);
  return found;
}

}  // namespace

Result<HomogeneousFit> fit_homogeneous(const ChannelProblem& problem,
                                       const InverseOptions& options,
                                       diffusion::FluenceSolver& solver,
                                       std::stop_token stop) {
  const ChannelProblem few = with_illuminations(problem, few_illuminations(problem, kFew));
  auto fit = fit_down_to(few, options, solver, stop);
  if (!fit || options.max_iterations > 0) return fit;
  return refine_homogeneous(problem, options, *fit, solver, std::move(stop));
}

Result<HomogeneousFit> refine_homogeneous(const ChannelProblem& problem,
                                          const InverseOptions& options,
                                          const HomogeneousFit& start,
                                          diffusion::FluenceSolver& solver,
                                          std::stop_token stop) {
  Fit all(problem, options, solver, std::move(stop));
  auto fit = all.from(logs_of(start));
  if (!fit) return fit;
  if (auto added = all.add_intervals(*fit, options.model_error); !added) return added.error();
  fit->solves += start.solves;
  return fit;
}

}  // namespace opaline::reconstruct
