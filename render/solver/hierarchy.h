#pragma once

#include <memory>
#include <vector>

#include "base/thread_team.h"
#include "render/solver/aggregation.h"
#include "render/solver/lane_matrix.h"
#include "render/solver/rough_matrix.h"

namespace opaline::render {

struct HierarchyOptions {
  double strength = 0.06;   ///< of couplings that make a group; halved at every coarser level
  int first_rings = 2;      ///< reach of the finest groups; coarser ones reach one ring
  int smoothing_steps = 1;  ///< Chebyshev steps before and after each correction; >= 1
  int coarsest_rows = 160;  ///< solved directly
  int most_levels =
      20;  ///< >= 1; the last one of fewer is smoothed, or solved directly where it is small
};

/// A multiresolution hierarchy of a diffusion matrix with its interpolation,
/// and one V-cycle over it as preconditioner: smoothed aggregation (Vanek,
/// Mandel & Brezina 1996), smoothed by Chebyshev polynomials of D^-1 A over
/// [lambda_max / 4, lambda_max] (Adams et al. 2003), Cholesky at the coarsest
/// level. Symmetric and positive definite, so that conjugate gradients may use
/// it.
///
/// Groups and interpolation are the same for all channels; matrices are not.
/// Built for one material it still serves, more iterations spent, when the
/// material has changed a little.
///
/// Threads: precondition() uses the team; one call at a time.
template <class T>
class Hierarchy {
 public:
  Hierarchy(const LaneMatrix<T>& finest, const HierarchyOptions& options);
  ~Hierarchy();
  Hierarchy(Hierarchy&&) noexcept;
  Hierarchy& operator=(Hierarchy&&) noexcept;

  /// z = B r, with B about A^-1. `finest` is the matrix as it was told last, by the constructor or by matrix_changed(). z and r
  /// are two vectors, of its rows.
  void precondition(const LaneMatrix<T>& finest,
                    const std::vector<Lanes<T>>& r,
                    std::vector<Lanes<T>>& z,
                    ThreadTeam& team);

  /// The finest matrix has other entries in the same pattern: it is smoothed by those, and coarser levels stay.
  void matrix_changed(const LaneMatrix<T>& finest);

  int levels() const;
  /// Entries of all levels over entries of the finest: what a cycle costs.
  double complexity() const;

 private:
  struct Level;
  struct Coarsest;
  template <class Row>
  void cycle(std::size_t level,
             const std::vector<Lanes<T>>& right,
             const Row& row,
             std::vector<Lanes<T>>& out,
             ThreadTeam& team);
  void descend(std::size_t level, ThreadTeam& team);

  HierarchyOptions options_;
  RoughEntries<T> rough_;  // of the finest matrix
  std::vector<Level> levels_;
  std::unique_ptr<Coarsest> coarsest_;
};

}  // namespace opaline::render
