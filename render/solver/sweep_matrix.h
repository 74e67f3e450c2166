#pragma once

#include <vector>

#include "base/flush_denormals.h"
#include "base/thread_team.h"
#include "render/solver/lane_matrix.h"
#include "render/solver/rough_matrix.h"
#include "render/solver/row_total.h"

namespace opaline::render {

/// A symmetric LaneMatrix by its couplings g_ik = -a_ik, each once, at the higher of its two rows. One walk over the rows serves
/// both ends: what a row hears of lower ones is gathered, what they hear of it is added to theirs. Where coupled rows are near in
/// memory all of that stays in a cache, and half of the matrix is read, once.
///
/// Rows are walked in blocks, at most one a thread. A coupling between two blocks, a seam, is kept at both ends, and heard of
/// when every block is done.
///
/// For smoothing there is Gauss-Seidel within the blocks, M = D' + L upwards and M^T downwards, where L has the couplings to
/// lower rows of the block, and D' is the diagonal with |g| of its seams added: it converges for every symmetric positive
/// definite matrix however that is cut (Baker, Falgout, Kolev & Yang, Multigrid smoothers for ultraparallel computing, 2011,
/// sec. 6: l1 hybrid Gauss-Seidel). It waits for memory and need not be exact, so it reads rough entries (rough_matrix.h).
///
/// Threads: each function of a block may run for all blocks at once, and must be done in all of them before the next begins.
template <class T>
class SweepMatrix {
 public:
  using Field = std::vector<Lanes<T>>;
  using Sum = typename RowTotal<T>::Sum;

  /// Products need the exact entries kept, smoothing does not.
  SweepMatrix(const LaneMatrix<T>& a, int blocks, bool keeps_exact);

  /// Other entries in the same pattern.
  void take_entries(const LaneMatrix<T>& a);

  int blocks() const { return static_cast<int>(blocks_.size()); }
  bool has_seams() const { return blocks() > 1; }

  /// work(block) for all of them.
  template <class Work>
  void over_blocks(ThreadTeam& team, const Work& work) const;
  /// The sum of what work(block) answers.
  template <class Work>
  Lanes<T> sum_over_blocks(ThreadTeam& team, const Work& work) const;

  /// x = M^-1 r; `rest` = r - A x but for the seams.
  void sweep_up(int block, const Field& r, Field& x, Field& rest) const;
  /// rest = r - A x.
  void add_seams_to_rest(int block, const Field& x, Field& rest) const;

  /// heard += the seams' part of r - A x.
  void hear_seams(int block, const Field& x, Field& heard) const;
  /// x += M^-T (r - A x). `heard` is the seams' part, and zero afterwards. Answers r . x.
  Sum sweep_down(int block, const Field& r, Field& heard, Field& x) const;

  /// product = A x but for the seams. next(row) makes x[row] first. Answers the share of x . A x, as a sum of squares:
  /// sum over rows of sink x^2 + sum over couplings of g (x_i - x_k)^2.
  template <class Next>
  Sum multiply(int block, const Next& next, const Field& x, Field& product) const;
  /// The seams' part of both.
  Sum multiply_seams(int block, const Field& x, Field& product) const;

 private:
  static constexpr int kFewestRows = 2048;  // of a block: fewer are not worth waking anybody

  struct Seams {
    std::vector<int> rows;       // with any, ascending
    std::vector<int> of_blocks;  // where each block's begin in `rows`; and the end
    std::vector<int> starts{0};  // of each of `rows` among columns
    std::vector<int> columns;
    std::vector<int> entries;  // where in the LaneMatrix
    Field couplings;
  };
  void find_couplings(const LaneMatrix<T>& a);
  void invert_diagonal();
  template <class Visit>
  void over_seams(int block, const Visit& visit) const;

  std::vector<RowRange> blocks_;
  std::vector<int> starts_{0};
  std::vector<int> columns_;
  std::vector<int> entries_;  // where in the LaneMatrix
  bool keeps_exact_;
  Field exact_;
  Field sinks_;  // where exact ones are kept
  RoughEntries<T> rough_;
  RoughEntries<T> rough_sinks_;
  Field inverse_;  // of D'
  Seams seams_;
};

template <class T>
template <class Work>
void SweepMatrix<T>::over_blocks(ThreadTeam& team, const Work& work) const {
  if (blocks() == 1) return static_cast<void>(work(0));
  team.run([&](int thread) {
    const FlushDenormals flush;
    for (int block = thread; block < blocks(); block += team.size()) work(block);
  });
}

template <class T>
template <class Work>
Lanes<T> SweepMatrix<T>::sum_over_blocks(ThreadTeam& team, const Work& work) const {
  std::vector<Sum> sums(blocks());
  over_blocks(team, [&](int block) { sums[block] = work(block); });
  return total_of<T>(sums);
}

template <class T>
template <class Next>
auto SweepMatrix<T>::multiply(int block, const Next& next, const Field& x, Field& product) const
    -> Sum {
  RowTotal<T> energy;
  const RowRange range = blocks_[block];
  const Lanes<T>* const values = x.data();
  Lanes<T>* const to = product.data();
  for (int k = range.first; k < range.last; ++k) {
    next(k);
    const Lanes<T> own = values[k];
    Lanes<T> sum = sinks_[k] * own;
    Lanes<T> squares = sum * own;
    for (int e = starts_[k]; e < starts_[k + 1]; ++e) {
      const Lanes<T> step = own - values[columns_[e]];
      const Lanes<T> flow = exact_[e] * step;
      squares += flow * step;
      sum += flow;
      to[columns_[e]] -= flow;
    }
    to[k] = sum;
    energy.add(squares);
  }
  return energy.value();
}

}  // namespace opaline::render
