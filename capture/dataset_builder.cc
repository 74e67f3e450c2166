#include "capture/dataset_builder.h"

#include <algorithm>
#include <cmath>

#include "capture/face_geometry.h"

namespace opaline::capture {
namespace {

bool lit(const Image<float>& irradiance, int x, int y) {
  return std::max({irradiance.at(x, y, 0), irradiance.at(x, y, 1), irradiance.at(x, y, 2)}) > 0.0F;
}

// Clears the cells whose centre lies within `margin_mm` of the lit cell (column, row).
void clear_around(
    Image<std::uint8_t>& mask, int column, int row, const CellSize& cell, double margin_mm) {
  const int reach_x = static_cast<int>(std::ceil(margin_mm / cell.width));
  const int reach_y = static_cast<int>(std::ceil(margin_mm / cell.height));
  for (int y = std::max(0, row - reach_y); y <= std::min(mask.height() - 1, row + reach_y); ++y) {
    for (int x = std::max(0, column - reach_x); x <= std::min(mask.width() - 1, column + reach_x);
         ++x) {
      const double distance = std::hypot((x - column) * cell.width, (y - row) * cell.height);
      if (distance <= margin_mm) mask.at(x, y) = 0;
    }
  }
}

void mask_direct_light(Image<std::uint8_t>& mask,
                       const Image<float>& irradiance,
                       const CellSize& cell,
                       double margin_mm) {
  for (int y = 0; y < irradiance.height(); ++y) {
    for (int x = 0; x < irradiance.width(); ++x) {
      if (lit(irradiance, x, y)) clear_around(mask, x, y, cell, margin_mm);
    }
  }
}

}  // namespace

Dataset empty_dataset(const SampleGeometry& sample, const SurfaceMap& map) {
  Dataset dataset;
  dataset.block = sample.block;
  dataset.ior = sample.ior;
  dataset.lit_face = sample.lit_face;
  dataset.seen_face = sample.seen_face;
  dataset.view_cosine = map.view_cosine();
  return dataset;
}

Illumination illumination_of(const Light& light,
                             const SurfaceRadiance& surface,
                             const SampleGeometry& sample,
                             double margin_mm,
                             bool usable) {
  Illumination measured{light.name,
                        light.held_out,
                        light.irradiance,
                        surface.radiance,
                        surface.variance,
                        surface.mask};
  if (!usable) std::ranges::fill(measured.mask.samples(), std::uint8_t{0});
  if (sample.lit_face == sample.seen_face) {
    const CellSize cell = face_cell_size(sample.block, sample.lit_face);
    mask_direct_light(measured.mask, light.irradiance, cell, margin_mm);
  }
  return measured;
}

}  // namespace opaline::capture
