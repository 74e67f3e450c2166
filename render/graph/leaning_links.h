#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <span>
#include <vector>

#include "base/thread_team.h"
#include "reconstruct/diffusion/boundary.h"
#include "reconstruct/diffusion/fluence_solver.h"
#include "render/graph/optics.h"
#include "render/graph/quad_graph.h"
#include "render/solver/lanes.h"

namespace opaline::render {

/// What two-point volumes miss where a link does not stand upright on its face: in cut tetrahedra at the surface, where sizes
/// change, and wherever the solid is bent.
///
/// Let x be where the link from node i to node k goes through their face (at the surface: the face's centroid), n the face's
/// normal and d_i node i's reach. The node's foot is x - d_i n, off the node by t_i = (x - x_i) - n ((x - x_i) . n). The flux
/// between the feet is exact for a field that is linear on either side and whose kappa steps at the face,
///
///   F = a / (d_i / kappa_i + d_k / kappa_k) (phi_i + delta_i - phi_k - delta_k),    delta_i = grad phi_i . t_i
///
/// and at the surface F = a g (phi_i + delta_i - S). The gradient is Green and Gauss's, V grad phi_i = sum_f a_f n_f (phi_f - phi_i),
/// with phi_f, at the face's centroid, what makes both sides' flux the same. The matrix stays that of the two-point scheme, and
/// delta goes to the right, from the last solution: a deferred correction (Ferziger & Peric, Computational methods for fluid
/// dynamics, 2002, sec. 8.6). It is antisymmetric over each face, so energy is conserved to rounding whatever delta is.
/// |delta| <= phi / 2: no face value is negative.
///
/// Shapes: as TwoPoint's. Threads: one call at a time.
template <class T>
class LeaningLinks {
 public:
  /// Graph, mesh and team must outlive it.
  LeaningLinks(const TetMesh& mesh,
               const QuadGraph& graph,
               const reconstruct::diffusion::Boundary& boundary,
               ThreadTeam& team);

  /// Takes the mesh as it is now, and the material. The gradients that were found stay.
  void update(std::span<const Optics> optics);

  /// Solves again and again, delta following, until the right-hand side changes by less than three times `tolerance`, relative,
  /// or `rounds` corrections were made; where it changes by more and more, phi is the two-point solution. `solve(b, tolerance)`
  /// starts from phi and leaves the solution there. The summary's iterations are those of all solutions.
  template <class Solve>
  reconstruct::diffusion::SolveSummary settle(std::span<const std::array<float, 3>> q,
                                              const std::vector<Lanes<T>>& load,
                                              const std::vector<Lanes<T>>& phi,
                                              double tolerance,
                                              int rounds,
                                              const Solve& solve);

  /// delta of the link to each surface node, for TwoPoint::surface_light().
  std::span<const Lanes<T>> at_surface() const { return surface_delta_; }
  std::size_t count() const { return cells_.size(); }  ///< tetrahedra with a link that leans

 private:
  using Gradient = std::array<Lanes<T>, 3>;
  struct Cell {
    int node = 0;
    std::array<Vec3, 4> lean;       // t of each link
    std::array<Vec3, 4> middle;     // of each face, from the node along the face
    std::array<Vec3, 4> beyond;     // the same from the node that is linked
    std::array<Vec3, 4> across;     // a n / V
    std::array<Lanes<T>, 4> share;  // of the node's side in the face's value
    std::array<Lanes<T>, 4> conductance;
  };
  struct Sight {
    std::span<const std::array<float, 3>> q;
    const std::vector<Lanes<T>>& phi;
  };
  Cell cell_at(int node) const;
  void weigh(Cell& cell) const;
  void clear();
  double follow(const Sight& sight, double share);
  Lanes<T> face_value(const Cell& cell, int k, const Gradient& own, const Sight& sight) const;
  Gradient gradient_of(const Cell& cell, const Gradient& now, const Sight& sight) const;
  void sum_up(const std::vector<Lanes<T>>* phi);

  const TetMesh& mesh_;
  const QuadGraph& graph_;
  reconstruct::diffusion::Boundary boundary_;
  ThreadTeam& team_;
  std::vector<Cell> cells_;
  std::vector<int> cell_of_;         // of each node; -1: all of its links stand upright
  std::vector<Gradient> gradients_;  // of each cell
  std::vector<Gradient> found_;
  std::vector<Lanes<T>> kappa_;  // of each node
  std::vector<Lanes<T>> surface_delta_;
  std::vector<Lanes<T>> sum_;  // what is added to the right-hand side
};

/// The norm of all channels together.
template <class T>
double norm_of(const std::vector<Lanes<T>>& values) {
  double sum = 0.0;
  for (const Lanes<T>& v : values) {
    for (int c = 0; c < 3; ++c) sum += static_cast<double>(v[c]) * static_cast<double>(v[c]);
  }
  return std::sqrt(sum);
}

template <class T>
template <class Solve>
reconstruct::diffusion::SolveSummary LeaningLinks<T>::settle(
    std::span<const std::array<float, 3>> q,
    const std::vector<Lanes<T>>& load,
    const std::vector<Lanes<T>>& phi,
    double tolerance,
    int rounds,
    const Solve& solve) {
  constexpr double kEnough = 3.0;  // tolerances
  constexpr double kInner = 0.1;   // of the last change: what a solution in between is worth
  constexpr int kMostGrowths = 3;
  const double size = std::max(norm_of(load), 1e-150);
  double before = std::numeric_limits<double>::infinity();
  double wanted = std::max(tolerance, rounds > 0 ? kInner * kInner : 0.0);
  double share = 1.0;
  int growths = 0;
  int iterations = 0;
  for (int round = 0;; ++round) {
    if (round == rounds) wanted = tolerance;
    std::vector<Lanes<T>> corrected = load;
    for (std::size_t i = 0; i < corrected.size(); ++i) corrected[i] += sum_[i];
    auto summary = solve(corrected, wanted);
    iterations += summary.iterations;
    summary.iterations = iterations;
    if (summary.termination != reconstruct::diffusion::Termination::kConverged || round >= rounds) {
      return summary;
    }
    const double change = follow({q, phi}, share) / size;
    if (change < kEnough * tolerance && wanted <= tolerance) return summary;
    if (change > before) {
      share *= 0.5;
      if (++growths == kMostGrowths) {
        clear();
        rounds = round + 1;
      }
    }
    before = change;
    wanted = std::max(tolerance, kInner * change);
  }
}

}  // namespace opaline::render
