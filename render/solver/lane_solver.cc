#include "render/solver/lane_solver.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "base/ensure.h"
#include "base/flush_denormals.h"
#include "render/solver/large_pages.h"
#include "render/solver/row_total.h"

namespace opaline::render {
namespace {

using reconstruct::diffusion::SolveOptions;
using reconstruct::diffusion::SolveSummary;
using reconstruct::diffusion::Termination;

template <class T>
bool is_finite(const Lanes<T>& lanes) {
  return std::isfinite(lanes[0]) && std::isfinite(lanes[1]) && std::isfinite(lanes[2]);
}

/// sqrt(r2 / b2), worst channel.
template <class T>
double relative(const Lanes<T>& r2, const Lanes<T>& b2) {
  double worst = 0.0;
  for (int lane = 0; lane < 3; ++lane) {
    if (b2[lane] > 0)
      worst =
          std::max(worst, std::sqrt(static_cast<double>(r2[lane]) / static_cast<double>(b2[lane])));
  }
  return worst;
}

template <class T>
void clear_dark_channels(const Lanes<T>& b2, std::vector<Lanes<T>>& x) {
  Lanes<T> lit{};
  for (int lane = 0; lane < kLanes; ++lane) lit.set(lane, b2[lane] > 0 ? T{1} : T{0});
  if (lit[0] * lit[1] * lit[2] > 0) return;
  for (Lanes<T>& value : x) value *= lit;
}

SolveSummary finished(Termination termination, int iterations, double residual) {
  return {termination,
          iterations,
          residual,
          fmt::format("{} iterations, relative residual {:.2g}", iterations, residual)};
}

}  // namespace

template <class T>
template <class Work>
Lanes<T> LaneSolver<T>::sum_over_rows(const Work& work) {
  const int rows = matrix_.rows();
  std::vector<typename RowTotal<T>::Sum> sums(team_.size());
  team_.run([&](int thread) {
    const FlushDenormals flush;
    const RowRange range = share_of(rows, thread, team_.size());
    RowTotal<T> sum;
    for (int i = range.first; i < range.last; ++i) sum.add(work(i));
    sums[thread] = sum.value();
  });
  return total_of<T>(sums);
}

template <class T>
Lanes<T> LaneSolver<T>::residual(const std::vector<Lanes<T>>& b, const std::vector<Lanes<T>>& x) {
  return sum_over_rows([&](int i) {
    r_[i] = b[i] - apply_row(matrix_, x.data(), i);
    return r_[i] * r_[i];
  });
}

template <class T>
Lanes<T> LaneSolver<T>::dot(const std::vector<Lanes<T>>& a, const std::vector<Lanes<T>>& b) {
  return sum_over_rows([&](int i) { return a[i] * b[i]; });
}

template <class T>
Lanes<T> LaneSolver<T>::turn(const Lanes<T>& alpha,
                             const Lanes<T>& beta,
                             std::vector<Lanes<T>>& x) {
  const auto next = [&](int i) {
    x[i] += alpha * p_[i];
    p_[i] = z_[i] + beta * p_[i];
  };
  Lanes<T> energy = sweeps_.sum_over_blocks(
      team_, [&](int block) { return sweeps_.multiply(block, next, p_, q_); });
  if (sweeps_.has_seams())
    energy += sweeps_.sum_over_blocks(
        team_, [&](int block) { return sweeps_.multiply_seams(block, p_, q_); });
  return energy;
}

template <class T>
Lanes<T> LaneSolver<T>::reduce(const Lanes<T>& alpha) {
  return sum_over_rows([&](int i) {
    r_[i] -= alpha * q_[i];
    return r_[i] * r_[i];
  });
}

template <class T>
void LaneSolver<T>::remember(const std::vector<Lanes<T>>& b, const std::vector<Lanes<T>>& x) {
  sum_over_rows([&](int i) {
    q_[i] = b[i] - r_[i];
    return Lanes<T>::zero();
  });
  history_.add(x, q_);
}

template <class T>
SolveSummary LaneSolver<T>::solve(const std::vector<Lanes<T>>& b,
                                  std::vector<Lanes<T>>& x,
                                  const SolveOptions& options,
                                  std::stop_token stop) {
  ENSURE(static_cast<int>(b.size()) == matrix_.rows() && x.size() == b.size());
  const FlushDenormals flush;
  for (auto* field : {&r_, &z_, &p_, &q_}) {
    reserve_large(*field, b.size());
    field->resize(b.size(), Lanes<T>::zero());
  }
  const Lanes<T> b2 = dot(b, b);
  history_.guess(b, x, team_);
  clear_dark_channels(b2, x);
  double start = relative(residual(b, x), b2);
  if (!is_finite(b2) || !std::isfinite(start)) return finished(Termination::kBreakdown, 0, start);
  SolveSummary summary = finished(Termination::kConverged, 0, start);
  while (summary.relative_residual > options.tolerance) {
    summary = iterate(b2, x, {options.tolerance, options.max_iterations}, summary.iterations, stop);
    summary.relative_residual = relative(residual(b, x), b2);
    if (summary.termination != Termination::kConverged) break;
    if (summary.relative_residual > std::max(options.tolerance, 0.5 * start)) {
      summary.termination = Termination::kBreakdown;
      break;
    }
    start = summary.relative_residual;
  }
  summary = finished(summary.termination, summary.iterations, summary.relative_residual);
  if (summary.termination == Termination::kConverged) remember(b, x);
  return summary;
}

template <class T>
SolveSummary LaneSolver<T>::iterate(const Lanes<T>& b2,
                                    std::vector<Lanes<T>>& x,
                                    const SolveOptions& options,
                                    int iteration,
                                    std::stop_token stop) {
  p_.assign(x.size(), Lanes<T>::zero());
  Lanes<T> rz = Lanes<T>::zero();
  Lanes<T> alpha = Lanes<T>::zero();  // x still lacks alpha p
  const auto ended = [&](Termination termination, double reached) {
    sum_over_rows([&](int i) {
      x[i] += alpha * p_[i];
      return Lanes<T>::zero();
    });
    return finished(termination, iteration, reached);
  };
  for (double reached = 1e300; reached > options.tolerance; ++iteration) {
    if (stop.stop_requested()) return ended(Termination::kCancelled, reached);
    if (iteration == options.max_iterations) return ended(Termination::kIterationLimit, reached);
    const Lanes<T> rz_now = hierarchy_.precondition(sweeps_, r_, z_, team_);
    const Lanes<T> beta = divide(rz_now, rz);
    rz = rz_now;
    alpha = divide(rz, turn(alpha, beta, x));
    reached = relative(reduce(alpha), b2);
    if (!std::isfinite(reached)) return ended(Termination::kBreakdown, reached);
  }
  return ended(Termination::kConverged, 0.0);
}

template class LaneSolver<float>;
template class LaneSolver<double>;

}  // namespace opaline::render
