#include "render/scene/measured_finish.h"

#include <algorithm>

#include "base/io/surface_io.h"
#include "render/scene/material_lookup.h"

namespace opaline::render {
namespace {

constexpr double kLeastMeasured = 1e-6;  // of a place's four cells, by weight

/// The axes along which a face's columns and rows lie.
std::array<int, 2> axes_of(Face face) {
  const int across = axis_of(face);
  return {across == 0 ? 1 : 0, across == 2 ? 1 : 2};
}

}  // namespace

Result<MeasuredFinish> MeasuredFinish::create(const TranslucentOptions& options) {
  auto surface = read_surface(options.surface_reflectance);
  if (!surface) return surface.error();
  MeasuredFinish finish(*std::move(surface), options);
  const SurfaceReflectance& s = finish.surface_;
  double count = 0.0;
  for (int y = 0; y < s.mask.height(); ++y) {
    for (int x = 0; x < s.mask.width(); ++x) {
      if (s.mask.at(x, y) == 0) continue;
      count += 1.0;
      for (int c = 0; c < 3; ++c) finish.mean_[c] += s.reflectance.at(x, y, c);
    }
  }
  if (count == 0.0) {
    return invalid_argument(options.surface_reflectance.string() + ": no cell of it was measured");
  }
  for (double& value : finish.mean_) value = std::max(0.0, value / count);
  return finish;
}

Colour MeasuredFinish::on_face(double column_mm, double row_mm) const {
  const auto [u, v] = axes_of(surface_.face);
  const auto spacing = surface_.block.spacing();
  const CellSpan column =
      span_at(column_mm / spacing[u] - 0.5, surface_.mask.width(), options_.tiling);
  const CellSpan row = span_at(row_mm / spacing[v] - 0.5, surface_.mask.height(), options_.tiling);
  Colour sum{};
  double measured = 0.0;
  for (const auto& [x, along] :
       {std::pair{column.low, 1.0 - column.share}, {column.high, column.share}}) {
    for (const auto& [y, across] : {std::pair{row.low, 1.0 - row.share}, {row.high, row.share}}) {
      if (surface_.mask.at(x, y) == 0) continue;
      const double weight = along * across;
      measured += weight;
      for (int c = 0; c < 3; ++c) sum[c] += weight * surface_.reflectance.at(x, y, c);
    }
  }
  if (measured < kLeastMeasured) return mean_;
  for (double& value : sum) value = std::max(0.0, value / measured);
  return sum;
}

Colour MeasuredFinish::at(Vec3 place, Vec3 normal) const {
  const Vec3 p = (place - options_.origin) * (1.0 / options_.scale);
  if (options_.placement == Placement::kSolid) {
    const std::array<double, 3> along{p.x, p.y, p.z};
    const auto [u, v] = axes_of(surface_.face);
    return on_face(along[u], along[v]);
  }
  const std::array<double, 3> weights = view_weights(normal);
  const std::array<std::array<double, 2>, 3> places{{{p.y, p.z}, {p.z, p.x}, {p.x, p.y}}};
  const double all = weights[0] + weights[1] + weights[2];
  Colour sum{};
  for (int k = 0; k < 3 && all > 0.0; ++k) {
    const Colour seen = on_face(places[k][0], places[k][1]);
    for (int c = 0; c < 3; ++c) sum[c] += weights[k] / all * seen[c];
  }
  return sum;
}

}  // namespace opaline::render
