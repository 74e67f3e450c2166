#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include "base/block.h"

namespace opaline::reconstruct {

/// How one coefficient's logarithm u varies inside a block: a few node values a, and between them
///
///   u = P a,   P = P_z (x) P_y (x) P_x,
///
/// each P_axis linear between nodes evenly spaced along its axis and constant beyond the outer ones. One node along an
/// axis: no variation along it; as many as there are cells: the cells themselves. So a row of P sums to one, and a
/// constant stays what it is.
///
/// Shapes: cell values in the block's order; node values likewise, x fastest, nodes()[axis] along each axis.
/// Threads: immutable, shared freely.
class FieldBasis {
 public:
  /// `nodes` along each axis, 1 to as many as there are cells.
  FieldBasis(const Block& block, std::array<int, 3> nodes);
  static FieldBasis homogeneous(const Block& block) { return {block, {1, 1, 1}}; }
  /// One value a layer of cells, counted along the axis `face` is perpendicular to.
  static FieldBasis layered(const Block& block, Face face);
  /// A node every `cells_a_node` cells along each axis, at least one; >= 1. 1: full.
  static FieldBasis blocks(const Block& block, int cells_a_node);
  /// A node every `cells_a_node` cells along `face`, every cell in depth.
  static FieldBasis columns(const Block& block, Face face, int cells_a_node);
  static FieldBasis full(const Block& block) { return blocks(block, 1); }

  std::size_t size() const { return static_cast<std::size_t>(nodes_[0]) * nodes_[1] * nodes_[2]; }
  std::array<int, 3> nodes() const { return nodes_; }
  std::size_t cell_count() const { return block_.cell_count(); }
  bool is_full() const { return nodes_ == block_.cells(); }

  /// u = P a.
  void expand(std::span<const double> nodes, std::span<double> cells) const;
  /// P^T g: what a gradient by cell values is by node values.
  void gather(std::span<const double> cells, std::span<double> nodes) const;
  /// Weighted means, diag(P^T 1)^-1 P^T u: the nodes that stand for given cell values.
  void average(std::span<const double> cells, std::span<double> nodes) const;
  bool operator==(const FieldBasis&) const = default;

 private:
  struct Place {  // of a cell between `node` and the next
    int node = 0;
    double next = 0.0;  // weight of the next
    bool operator==(const Place&) const = default;
  };
  static std::vector<Place> places(int cells, int nodes);
  template <class Visit>
  void for_each_weight(Visit visit) const;

  Block block_;
  std::array<int, 3> nodes_;
  std::array<std::vector<Place>, 3> places_;
};

/// What a channel's minimisation varies: node values of log sigma_s', then of log sigma_a, each on its own basis;
/// and the cell values that they make, p of Objective: all log sigma_s' first.
class Parametrization {
 public:
  /// Both of one block.
  Parametrization(FieldBasis reduced_scattering, FieldBasis absorption);
  static Parametrization full(const Block& block) {
    return {FieldBasis::full(block), FieldBasis::full(block)};
  }

  const FieldBasis& reduced_scattering() const { return reduced_scattering_; }
  const FieldBasis& absorption() const { return absorption_; }
  std::size_t size() const { return reduced_scattering_.size() + absorption_.size(); }
  std::size_t cell_value_count() const { return 2 * reduced_scattering_.cell_count(); }

  /// P a: cell values of parameters; of their tangents too, since P is linear.
  std::vector<double> expand(std::span<const double> parameters) const;
  /// P^T g: the gradient by parameters of a gradient by cell values.
  std::vector<double> gather(std::span<const double> cell_values) const;
  /// The parameters that stand for given cell values: exact when those vary no faster than the nodes can follow.
  std::vector<double> average(std::span<const double> cell_values) const;
  bool operator==(const Parametrization&) const = default;

 private:
  FieldBasis reduced_scattering_;
  FieldBasis absorption_;
};

}  // namespace opaline::reconstruct
