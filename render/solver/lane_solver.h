#pragma once

#include <stop_token>
#include <vector>

#include "base/thread_team.h"
#include "reconstruct/diffusion/fluence_solver.h"
#include "render/solver/hierarchy.h"
#include "render/solver/solution_history.h"

namespace opaline::render {

/// Conjugate gradients preconditioned by a hierarchy, all channels in one
/// sweep, from x as given (zeros, or the last frame's field: a warm start) or
/// from the best combination of the last solutions. Stops where ||b - A x|| /
/// ||b|| of every channel is at most the tolerance; a channel without light has
/// the solution 0 and counts as done. The residual it reports is computed from
/// x; where rounding keeps that above the tolerance, the answer is kBreakdown
/// and says so.
///
/// Shapes:  matrix, b and x have as many rows.
/// Threads: one solve at a time per object. Rows are swept in as many blocks as the team has threads
/// (sweep_matrix.h), so teams of two sizes agree within the tolerance, not to the bit.
template <class T>
class LaneSolver {
 public:
  /// The matrix may be changed between solves, not its pattern: call
  /// matrix_changed(). `remembered` solutions, at most 4, are combined to start
  /// from. Matrix and team must outlive the solver.
  LaneSolver(const LaneMatrix<T>& matrix,
             const HierarchyOptions& options,
             ThreadTeam& team,
             int remembered = 0)
      : matrix_(matrix),
        team_(team),
        sweeps_(matrix, team.size(), true),
        hierarchy_(matrix, options, team.size()),
        history_(remembered) {}

  reconstruct::diffusion::SolveSummary solve(const std::vector<Lanes<T>>& b,
                                             std::vector<Lanes<T>>& x,
                                             const reconstruct::diffusion::SolveOptions& options,
                                             std::stop_token stop);

  /// The hierarchy stays, and serves until the matrix has changed much. One product for every remembered solution: the next start
  /// is their best combination for the new matrix.
  void matrix_changed() {
    sweeps_.take_entries(matrix_);
    history_.refresh(matrix_, team_);
  }
  /// Starts from x alone next time.
  void forget() { history_.clear(); }
  void rebuild(const HierarchyOptions& options) {
    hierarchy_ = Hierarchy<T>(matrix_, options, team_.size());
  }
  const Hierarchy<T>& hierarchy() const { return hierarchy_; }

 private:
  Lanes<T> residual(const std::vector<Lanes<T>>& b,
                    const std::vector<Lanes<T>>& x);  // into r_; its squared norm
  Lanes<T> dot(const std::vector<Lanes<T>>& a, const std::vector<Lanes<T>>& b);
  Lanes<T> turn(const Lanes<T>& alpha,
                const Lanes<T>& beta,
                std::vector<Lanes<T>>& x);  // x += alpha p, p = z + beta p, q = A p; p . q
  Lanes<T> reduce(const Lanes<T>& alpha);   // r -= alpha q; its squared norm
  reconstruct::diffusion::SolveSummary iterate(const Lanes<T>& b2,
                                               std::vector<Lanes<T>>& x,
                                               const reconstruct::diffusion::SolveOptions& options,
                                               int iteration,
                                               std::stop_token stop);
  void remember(const std::vector<Lanes<T>>& b, const std::vector<Lanes<T>>& x);
  template <class Work>
  Lanes<T> sum_over_rows(const Work& work);

  const LaneMatrix<T>& matrix_;
  ThreadTeam& team_;
  SweepMatrix<T> sweeps_;
  Hierarchy<T> hierarchy_;
  SolutionHistory<T> history_;
  std::vector<Lanes<T>> r_;
  std::vector<Lanes<T>> z_;
  std::vector<Lanes<T>> p_;
  std::vector<Lanes<T>> q_;
};

}  // namespace opaline::render
