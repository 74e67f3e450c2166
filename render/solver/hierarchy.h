#pragma once

#include <memory>
#include <vector>

#include "base/thread_team.h"
#include "render/solver/aggregation.h"
#include "render/solver/lane_matrix.h"
#include "render/solver/sweep_matrix.h"

namespace opaline::render {

struct HierarchyOptions {
  double strength = 0.06;   ///< of couplings that make a group; halved at every coarser level
  int first_rings = 3;      ///< reach of the finest groups; coarser ones reach one ring
  int coarsest_rows = 160;  ///< solved directly
  int most_levels =
      20;  ///< >= 1; the last one of fewer is smoothed, or solved directly where it is small
};

/// A multiresolution hierarchy of a diffusion matrix with its interpolation,
/// and one V-cycle over it as preconditioner: smoothed aggregation (Vanek,
/// Mandel & Brezina 1996), one Gauss-Seidel sweep up before each correction and
/// one down after it (sweep_matrix.h), Cholesky at the coarsest level. Symmetric
/// and positive definite, so that conjugate gradients may use it.
///
/// Groups and interpolation are the same for all channels; matrices are not.
/// Built for one material it still serves, more iterations spent, when the
/// material has changed a little.
///
/// Threads: precondition() uses the team; one call at a time.
template <class T>
class Hierarchy {
 public:
  using Field = std::vector<Lanes<T>>;

  /// Swept by so many threads.
  Hierarchy(const LaneMatrix<T>& finest, const HierarchyOptions& options, int threads);
  ~Hierarchy();
  Hierarchy(Hierarchy&&) noexcept;
  Hierarchy& operator=(Hierarchy&&) noexcept;

  /// z = B r, with B about A^-1; answers r . z. `finest` has the rows of the matrix that the hierarchy was made for; its entries
  /// may have changed since: it is smoothed by those, and coarser levels stay. z and r are two fields.
  Lanes<T> precondition(const SweepMatrix<T>& finest, const Field& r, Field& z, ThreadTeam& team);

  int levels() const;
  /// Entries of all levels over entries of the finest: what a cycle costs.
  double complexity() const { return 1.0 + entries_; }

 private:
  struct Level;
  struct Coarsest;
  Lanes<T> cycle(
      std::size_t level, const SweepMatrix<T>& a, const Field& r, Field& x, ThreadTeam& team);
  void descend(std::size_t level, ThreadTeam& team);

  std::vector<Level> levels_;
  std::unique_ptr<Coarsest> coarsest_;
  double entries_ = 0.0;  // of the coarser levels, over those of the finest
};

}  // namespace opaline::render
