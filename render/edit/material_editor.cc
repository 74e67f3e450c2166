#include "render/edit/material_editor.h"

#include <algorithm>
#include <cmath>

namespace opaline::render {
namespace {

constexpr double kLeastScattering = 1e-6;

double edited(const EditOptions& edit, double old, double value, double weight) {
  switch (edit.operation) {
    case EditOptions::Operation::kPaint:
      return old + weight * (value - old);
    case EditOptions::Operation::kScale:
      return old * std::pow(value, weight);
    case EditOptions::Operation::kAdd:
      return old + weight * value;
    case EditOptions::Operation::kSet:
      break;
  }
  return weight >= 0.5 ? value : old;
}

/// The cells whose centres lie between two places along one axis.
std::pair<int, int> cells_between(double low, double high, double cell, int count) {
  const double first = std::ceil(std::clamp(low / cell - 0.5, 0.0, static_cast<double>(count)));
  const double last = std::floor(std::clamp(high / cell - 0.5, -1.0, count - 1.0));
  return {static_cast<int>(first), static_cast<int>(last)};
}

}  // namespace

MaterialEditor::MaterialEditor(std::shared_ptr<Material> block,
                               Vec3 origin,
                               double scale,
                               EditWeight::DistanceAt distance,
                               std::size_t history_bytes)
    : block_(std::move(block)),
      origin_(origin),
      scale_(scale),
      distance_(std::move(distance)),
      history_(history_bytes) {}

Box MaterialEditor::box() const { return {origin_, origin_ + block_->block.size() * scale_}; }

Vec3 MaterialEditor::centre_of(int i, int j, int k) const {
  const Block& b = block_->block;
  return origin_ + Vec3{(i + 0.5) * b.hx, (j + 0.5) * b.hy, (k + 0.5) * b.hz} * scale_;
}

Result<std::size_t> MaterialEditor::apply(const EditOptions& edit) {
  if (auto valid = validate(edit); !valid) return valid.error();
  std::optional<Mask> mask;
  if (!edit.mask.empty()) {
    auto read = Mask::read(edit.mask);
    if (!read) return read.error();
    mask = *std::move(read);
  }
  const EditWeight weight(edit, distance_, mask ? &*mask : nullptr);
  const Box reach = weight.reach(box());
  const Block& b = block_->block;
  const auto [i0, i1] = cells_between(
      (reach.low.x - origin_.x) / scale_, (reach.high.x - origin_.x) / scale_, b.hx, b.nx);
  const auto [j0, j1] = cells_between(
      (reach.low.y - origin_.y) / scale_, (reach.high.y - origin_.y) / scale_, b.hy, b.ny);
  const auto [k0, k1] = cells_between(
      (reach.low.z - origin_.z) / scale_, (reach.high.z - origin_.z) / scale_, b.hz, b.nz);
  const bool scatters = edit.quantity == EditOptions::Quantity::kReducedScattering;
  Stroke stroke{edit.quantity, {}, {}};
  for (int k = k0; k <= k1; ++k) {
    for (int j = j0; j <= j1; ++j) {
      for (int i = i0; i <= i1; ++i) {
        const double w = weight.at(centre_of(i, j, k));
        if (!(w > 0.0)) continue;
        const std::size_t cell = b.index(i, j, k);
        std::array<double, 3> before{};
        bool changed = false;
        for (int c = 0; c < kColorChannels; ++c) {
          double& value = values_of(*block_, c, edit.quantity)[cell];
          before[c] = value;
          value = std::clamp(
              edited(edit, value, edit.value[c], w), scatters ? kLeastScattering : 0.0, 1e6);
          changed = changed || value != before[c];
        }
        if (!changed) continue;
        stroke.cells.push_back(static_cast<std::uint32_t>(cell));
        stroke.values.push_back(before);
      }
    }
  }
  const std::size_t cells = stroke.cells.size();
  if (cells > 0) history_.add(std::move(stroke));
  return cells;
}

}  // namespace opaline::render
