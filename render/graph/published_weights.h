#pragma once

#include <array>
#include <span>
#include <vector>

#include "base/result.h"
#include "reconstruct/diffusion/boundary.h"
#include "render/graph/optics.h"
#include "render/graph/quad_graph.h"
#include "render/solver/lane_matrix.h"

namespace opaline::render {

/// Wang 2010 as printed, to compare with (GraphWeights::kAsPublished), solved for to a residual. With d the length of a link,
///
///   sum_k (kappa_k phi_k - kappa_i phi_i) / d_ik^2 = sigma_a phi_i                     (Eq. 5)
///   phi_s + 2 A kappa_i (phi_s - phi_i) / d = S,   S = 4 q / (1 - R_phi)               (Eq. 6)
///
/// is symmetric and positive definite in psi = kappa phi, with each phi_s put in; that is what the matrix stands for, the
/// unknowns in 1/mm of TwoPoint's times kappa. It discretises laplace(kappa phi), and is not consistent on irregular tetrahedra:
/// 8.5 to 9 % off on the sphere with the exact solution, however fine they are (docs/physics.md).
///
/// Shapes: as of TwoPoint.
template <class T>
class PublishedWeights {
 public:
  /// The graph must outlive it.
  PublishedWeights(const QuadGraph& graph, const reconstruct::diffusion::Boundary& boundary)
      : graph_(graph), boundary_(boundary) {}

  /// Takes the material and the graph's lengths as they are now. Errors: as of TwoPoint.
  Result<void> set_material(std::span<const Optics> optics);

  const LaneMatrix<T>& matrix() const { return matrix_; }
  /// The right-hand side of light q, transmitted into the surface, W/mm^2.
  void load(std::span<const std::array<float, 3>> q, std::vector<Lanes<T>>& b) const;
  /// What a watt scattered in node i adds to its right-hand side.
  double load_of_power(std::size_t i) const { return 1.0 / graph_.volumes[i]; }
  SurfaceLight surface_light(std::span<const std::array<float, 3>> q,
                             const std::vector<Lanes<T>>& psi) const;

 private:
  const QuadGraph& graph_;
  reconstruct::diffusion::Boundary boundary_;
  LaneMatrix<T> matrix_;
  std::vector<std::array<double, 3>> diffusion_;  // kappa of each surface node
  std::vector<std::array<double, 3>> blends_;     // phi_s = S + blend (phi_i - S)
};

}  // namespace opaline::render
