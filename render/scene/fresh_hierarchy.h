#pragma once

#include <algorithm>

#include "render/solver/lane_solver.h"

namespace opaline::render {

/// A LaneSolver whose matrix changes now and then: its hierarchy is made anew once a changed matrix has taken half as many
/// iterations again as the first solution took from nothing.
template <class T>
class FreshHierarchy {
 public:
  FreshHierarchy(const LaneMatrix<T>& matrix, const HierarchyOptions& options, ThreadTeam& team)
      : options_(options), solver_(matrix, options, team, kRemembered) {}

  void matrix_changed() {
    if (stale_) solver_.rebuild(options_);
    stale_ = false;
    solver_.matrix_changed();
  }

  reconstruct::diffusion::SolveSummary solve(const std::vector<Lanes<T>>& b,
                                             std::vector<Lanes<T>>& x,
                                             const reconstruct::diffusion::SolveOptions& options,
                                             std::stop_token stop) {
    auto summary = solver_.solve(b, x, options, std::move(stop));
    if (cold_iterations_ == 0) cold_iterations_ = summary.iterations;
    stale_ = 2 * summary.iterations > 3 * std::max(cold_iterations_, 1);
    return summary;
  }

 private:
  static constexpr int kRemembered = 4;

  HierarchyOptions options_;
  LaneSolver<T> solver_;
  int cold_iterations_ = 0;
  bool stale_ = false;
};

}  // namespace opaline::render
