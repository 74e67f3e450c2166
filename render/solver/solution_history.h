#pragma once

#include <deque>
#include <vector>

#include "base/thread_team.h"
#include "render/solver/lane_matrix.h"

namespace opaline::render {

/// The last solutions of one matrix, to guess the next from: frame coherence.
/// Of all combinations x = sum c_j x_j it takes, channel by channel, the one
/// with the smallest residual ||b - sum c_j A x_j|| (Fischer, Projection
/// techniques for iterative solution of Ax = b with successive right-hand
/// sides, 1998). A light that moves smoothly, or brightens, is mostly such a
/// combination.
template <class T>
class SolutionHistory {
 public:
  explicit SolutionHistory(int most) : most_(most) {}

  /// Remembers x with A x, the oldest giving way.
  void add(const std::vector<Lanes<T>>& x, const std::vector<Lanes<T>>& ax);
  void clear() { kept_.clear(); }
  /// Makes the A x of another matrix: what an edit changes is mostly what the one before it changed.
  void refresh(const LaneMatrix<T>& matrix, ThreadTeam& team);

  /// Replaces x by the best combination; leaves it where nothing is remembered.
  void guess(const std::vector<Lanes<T>>& b, std::vector<Lanes<T>>& x, ThreadTeam& team) const;

 private:
  struct Solution {
    std::vector<Lanes<T>> x;
    std::vector<Lanes<T>> ax;
  };
  std::vector<Lanes<T>> best_combination(const std::vector<Lanes<T>>& b, ThreadTeam& team) const;

  int most_;
  std::deque<Solution> kept_;  // newest first
};

}  // namespace opaline::render
