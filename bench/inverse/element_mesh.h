#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "base/block.h"
#include "base/material.h"

namespace opaline::bench {

/// Elements a cell along x, y and z; >= 1 each.
using Refinement = std::array<int, 3>;

/// The matrix of one element over its eight corners, x fastest, symmetric, row by row.
using ElementMatrix = std::array<double, 64>;

/// One axis of a mesh of boxes: the widths of its elements, and where they lie in the next coarser axis, whose elements
/// hold one or two of these.
struct ElementAxis {
  std::vector<double> widths;  ///< mm
  std::vector<std::uint32_t>
      parents;  ///< the coarse element of each element; empty on the coarsest
  /// Of each node: the share of the right end of its coarse element; the left end is parent_node.
  std::vector<double> shares;
  std::vector<std::uint32_t> parent_nodes;

  std::size_t elements() const { return widths.size(); }
  std::size_t nodes() const { return widths.size() + 1; }
};

/// Trilinear elements on a tensor grid, and their assembled matrix
///
///   int kappa grad phi . grad v + int sigma_a phi v + int_surface phi v / (2 A)
///
/// as 27 coefficients a node (x offset fastest, 13 is the diagonal; zero where a neighbour is outside).
struct ElementMesh {
  std::array<ElementAxis, 3> axes;
  std::vector<double> stencil;

  std::size_t nodes() const { return axes[0].nodes() * axes[1].nodes() * axes[2].nodes(); }
  std::size_t elements() const {
    return axes[0].elements() * axes[1].elements() * axes[2].elements();
  }
  std::size_t node(std::size_t i, std::size_t j, std::size_t k) const {
    return (k * axes[1].nodes() + j) * axes[0].nodes() + i;
  }
  std::size_t element(std::size_t i, std::size_t j, std::size_t k) const {
    return (k * axes[1].elements() + j) * axes[0].elements() + i;
  }
};

/// The block's mesh, finest first, and coarser ones by Galerkin's product P^T K P, element by element: an axis is halved
/// while its elements are no wider than 1.5 times the narrowest axis's, down to a few elements in all.
std::vector<ElementMesh> element_hierarchy(const Block& block,
                                           const ChannelCoefficients& coefficients,
                                           double boundary_a,
                                           const Refinement& refinement);

}  // namespace opaline::bench
