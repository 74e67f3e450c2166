#pragma once

#include <memory>
#include <span>
#include <vector>

#include "bench/inverse/element_mesh.h"

namespace opaline::bench {

/// Right-hand sides that one solve takes.
inline constexpr int kElementFields = 8;

/// Solves K phi = b on the finest mesh for eight right-hand sides at once, by conjugate gradients preconditioned with a
/// V-cycle of one Gauss-Seidel sweep before and one, backwards, after. Double precision throughout.
///
/// Shapes:  b and phi hold eight values a node, one after another; phi is the answer, its old values do not matter.
/// Threads: one solve at a time per object; several objects may share the meshes, which must outlive them.
class ElementSolver {
 public:
  explicit ElementSolver(const std::vector<ElementMesh>& levels);
  ~ElementSolver();
  ElementSolver(const ElementSolver&) = delete;
  ElementSolver& operator=(const ElementSolver&) = delete;

  /// Down to ||b - K phi|| <= tolerance ||b|| for every right-hand side; returns the iterations that took.
  int solve(std::span<const double> b, std::span<double> phi, double tolerance);

 private:
  class Levels;
  std::unique_ptr<Levels> levels_;
};

}  // namespace opaline::bench
