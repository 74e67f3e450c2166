#pragma once

#include <cstddef>
#include <vector>

#include "base/thread_team.h"
#include "render/solver/lanes.h"

namespace opaline::render {

/// Three symmetric sparse matrices of one pattern, one a channel, by their
/// entries beside the diagonal and the sums of their rows:
///
///   (A x)_i = sum_k a_ik (x_k - x_i) + sink_i x_i
///
/// For a diffusion equation -a_ik is a conductance and sink_i what is absorbed
/// and leaves through the surface. So written a small sink beside large
/// conductances is not lost to rounding.
template <class T>
struct LaneMatrix {
  std::vector<int> starts{0};  ///< of each row among columns; one more than there are rows
  std::vector<int> columns;
  std::vector<Lanes<T>> entries;  ///< a_ik, beside the diagonal
  std::vector<Lanes<T>> sinks;    ///< row sums

  int rows() const { return static_cast<int>(sinks.size()); }
  Lanes<T> diagonal(int row) const {
    Lanes<T> sum = sinks[row];
    for (int e = starts[row]; e < starts[row + 1]; ++e) sum -= entries[e];
    return sum;
  }
};

/// The rows of one thread of a team.
struct RowRange {
  int first = 0;
  int last = 0;
};
inline RowRange share_of(int rows, int thread, int threads) {
  const auto at = [rows, threads](int t) {
    return static_cast<int>(static_cast<long>(rows) * t / threads);
  };
  return {at(thread), at(thread + 1)};
}

/// One row of A x.
template <class T>
inline Lanes<T> apply_row(const LaneMatrix<T>& a, const Lanes<T>* x, int row) {
  const Lanes<T> own = x[row];
  Lanes<T> sum = a.sinks[row] * own;
  for (int e = a.starts[row]; e < a.starts[row + 1]; ++e)
    sum += a.entries[e] * (x[a.columns[e]] - own);
  return sum;
}

}  // namespace opaline::render
