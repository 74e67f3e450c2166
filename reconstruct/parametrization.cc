#include "reconstruct/parametrization.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/ensure.h"

namespace opaline::reconstruct {

FieldBasis::FieldBasis(const Block& block, std::array<int, 3> nodes)
    : block_(block), nodes_(nodes) {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    ENSURE(nodes[axis] >= 1 && nodes[axis] <= block.cells()[axis]);
    places_[axis] = places(block.cells()[axis], nodes[axis]);
  }
}

FieldBasis FieldBasis::layered(const Block& block, Face face) {
  const auto axis = static_cast<std::size_t>(axis_of(face));
  std::array<int, 3> nodes{1, 1, 1};
  nodes[axis] = block.cells()[axis];
  return {block, nodes};
}

FieldBasis FieldBasis::blocks(const Block& block, int cells_a_node) {
  ENSURE(cells_a_node >= 1);
  std::array<int, 3> nodes{};
  for (std::size_t axis = 0; axis < 3; ++axis)
    nodes[axis] = (block.cells()[axis] + cells_a_node - 1) / cells_a_node;
  return {block, nodes};
}

FieldBasis FieldBasis::columns(const Block& block, Face face, int cells_a_node) {
  const auto axis = static_cast<std::size_t>(axis_of(face));
  std::array<int, 3> nodes = blocks(block, cells_a_node).nodes();
  nodes[axis] = block.cells()[axis];
  return {block, nodes};
}

std::vector<FieldBasis::Place> FieldBasis::places(int cells, int nodes) {
  std::vector<Place> out;
  for (int i = 0; i < cells; ++i) {
    const double at = std::clamp((i + 0.5) * nodes / cells - 0.5, 0.0, nodes - 1.0);
    const int node = static_cast<int>(at);
    out.push_back({node, at - node});
  }
  return out;
}

template <class Visit>
void FieldBasis::for_each_weight(Visit visit) const {
  std::size_t cell = 0;
  const auto along = [](const Place& place, double weight, auto inner) {
    inner(place.node, weight * (1.0 - place.next));
    if (place.next > 0.0) inner(place.node + 1, weight * place.next);
  };
  for (const Place& z : places_[2]) {
    for (const Place& y : places_[1]) {
      for (const Place& x : places_[0]) {
        along(z, 1.0, [&](int k, double wz) {
          along(y, wz, [&](int j, double wy) {
            along(x, wy, [&](int i, double w) {
              visit(cell, (static_cast<std::size_t>(k) * nodes_[1] + j) * nodes_[0] + i, w);
            });
          });
        });
        ++cell;
      }
    }
  }
}

void FieldBasis::expand(std::span<const double> nodes, std::span<double> cells) const {
  ENSURE(nodes.size() == size() && cells.size() == cell_count());
  if (is_full()) {
    std::ranges::copy(nodes, cells.begin());
    return;
  }
  std::ranges::fill(cells, 0.0);
  for_each_weight([&](std::size_t c, std::size_t n, double w) { cells[c] += w * nodes[n]; });
}

void FieldBasis::gather(std::span<const double> cells, std::span<double> nodes) const {
  ENSURE(nodes.size() == size() && cells.size() == cell_count());
  if (is_full()) {
    std::ranges::copy(cells, nodes.begin());
    return;
  }
  std::ranges::fill(nodes, 0.0);
  for_each_weight([&](std::size_t c, std::size_t n, double w) { nodes[n] += w * cells[c]; });
}

void FieldBasis::average(std::span<const double> cells, std::span<double> nodes) const {
  gather(cells, nodes);
  if (is_full()) return;
  std::vector<double> weight(nodes.size(), 0.0);
  for_each_weight([&](std::size_t, std::size_t n, double w) { weight[n] += w; });
  for (std::size_t n = 0; n < nodes.size(); ++n) nodes[n] /= weight[n];
}

Parametrization::Parametrization(FieldBasis reduced_scattering, FieldBasis absorption)
    : reduced_scattering_(std::move(reduced_scattering)), absorption_(std::move(absorption)) {
  ENSURE(reduced_scattering_.cell_count() == absorption_.cell_count());
}

std::vector<double> Parametrization::expand(std::span<const double> parameters) const {
  ENSURE(parameters.size() == size());
  const std::size_t cells = reduced_scattering_.cell_count();
  const std::size_t split = reduced_scattering_.size();
  std::vector<double> out(2 * cells);
  reduced_scattering_.expand(parameters.first(split), std::span(out).first(cells));
  absorption_.expand(parameters.subspan(split), std::span(out).subspan(cells));
  return out;
}

std::vector<double> Parametrization::gather(std::span<const double> cell_values) const {
  ENSURE(cell_values.size() == cell_value_count());
  const std::size_t cells = reduced_scattering_.cell_count();
  const std::size_t split = reduced_scattering_.size();
  std::vector<double> out(size());
  reduced_scattering_.gather(cell_values.first(cells), std::span(out).first(split));
  absorption_.gather(cell_values.subspan(cells), std::span(out).subspan(split));
  return out;
}

std::vector<double> Parametrization::average(std::span<const double> cell_values) const {
  ENSURE(cell_values.size() == cell_value_count());
  const std::size_t cells = reduced_scattering_.cell_count();
  const std::size_t split = reduced_scattering_.size();
  std::vector<double> out(size());
  reduced_scattering_.average(cell_values.first(cells), std::span(out).first(split));
  absorption_.average(cell_values.subspan(cells), std::span(out).subspan(split));
  return out;
}

}  // namespace opaline::reconstruct
