#pragma once

#include <span>

#include "reconstruct/diffusion/boundary.h"
#include "render/graph/optics.h"
#include "render/graph/polygrid.h"
#include "render/graph/quad_graph.h"
#include "render/solver/lane_matrix.h"

namespace opaline::render {

/// Two-point finite volumes on a QuadGraph or Polygrid (Eymard, Gallouet & Herbin, Finite
/// volume methods, 2000, sec. 9; boundary as in docs/physics.md):
///
///   sum_faces a / (d_i / kappa_i + d_k / kappa_k) (phi_i - phi_k) +
///   (sum_surface a g + V sigma_a) phi_i = sum_surface a g S g = 1 / (2 A + d /
///   kappa_i),   S = 4 q / (1 - R_phi),   J_n = g (phi_i - S),   phi_s = S + 2
///   A J_n
///
/// d: from a node to the plane of the face. Conserves energy to rounding, has a
/// maximum principle, treats steps in kappa as layers in series, and is
/// consistent where links are perpendicular to faces: everywhere in the
/// lattice's interior.
///
/// Shapes: optics one an inner node; q and the answers one a surface node.
template <class T, class Graph = QuadGraph>
class TwoPoint {
 public:
  /// The graph must outlive it.
  TwoPoint(const Graph& graph, const reconstruct::diffusion::Boundary& boundary);

  /// Takes the material; the matrix keeps its pattern. Errors:
  /// kInvalidArgument, see validate(optics), or shapes differ.
  Result<void> set_material(std::span<const Optics> optics);

  const LaneMatrix<T>& matrix() const { return matrix_; }
  /// The right-hand side of light q, transmitted into the surface, W/mm^2.
  void load(std::span<const std::array<float, 3>> q, std::vector<Lanes<T>>& b) const;
  /// What a watt scattered in node i adds to its right-hand side.
  double load_of_power(std::size_t /*i*/) const { return 1.0; }
  /// `delta`, where it is not empty, is what the fluence at the foot of each surface node's link is more than the inner
  /// node's (render/graph/leaning_links.h).
  SurfaceLight surface_light(std::span<const std::array<float, 3>> q,
                             const std::vector<Lanes<T>>& phi,
                             std::span<const Lanes<T>> delta = {}) const;

 private:
  const Graph& graph_;
  reconstruct::diffusion::Boundary boundary_;
  LaneMatrix<T> matrix_;
  std::vector<Lanes<T>> conductances_;  // g of each surface node
};

}  // namespace opaline::render
