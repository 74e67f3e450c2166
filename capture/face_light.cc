#include "capture/face_light.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <vector>

#include "capture/face_geometry.h"

namespace opaline::capture {
namespace {

struct Overlap {
  int cell = 0;
  double share = 0.0;  // of the cell's length
};

// For each projector pixel along one axis, the cells it lies on. Lengths in mm.
std::vector<std::vector<Overlap>> overlaps(
    int pixels, double offset_px, double mm_per_pixel, int cells, double cell_mm) {
  std::vector<std::vector<Overlap>> all(static_cast<std::size_t>(pixels));
  for (int p = 0; p < pixels; ++p) {
    const double begin = (p - offset_px) * mm_per_pixel;
    const double end = begin + mm_per_pixel;
    const int first = std::max(0, static_cast<int>(std::floor(begin / cell_mm)));
    for (int c = first; c < cells && c * cell_mm < end; ++c) {
      const double length = std::min(end, (c + 1) * cell_mm) - std::max(begin, c * cell_mm);
      if (length > 0.0) all[static_cast<std::size_t>(p)].push_back({c, length / cell_mm});
    }
  }
  return all;
}

struct PixelRectangle {
  int left = 0;
  int top = 0;
  int right = 0;
  int bottom = 0;
};

class PerpendicularLight : public FaceLight {
 public:
  PerpendicularLight(const Block& block, Face lit_face, const ProjectorCalibration& projector)
      : block_(block), face_(lit_face), projector_(projector) {}

  Result<void> check(const LitRectangle& rectangle) const override {
    const PixelRectangle box = pixels_of(rectangle);
    if (box.left < 0 || box.top < 0 || box.right > projector_.width ||
        box.bottom > projector_.height) {
      return invalid_argument(
          fmt::format("needs projector pixels x {} to {}, y {} to {}, and the projector has {} x "
                      "{}: expected a lit face within its picture",
                      box.left,
                      box.right,
                      box.top,
                      box.bottom,
                      projector_.width,
                      projector_.height));
    }
    if (box.right <= box.left || box.bottom <= box.top)
      return invalid_argument("is smaller than a projector pixel: expected fewer regions");
    return ok();
  }

  Image<std::uint8_t> pixels_on(const LitRectangle& rectangle) const override {
    const PixelRectangle box = pixels_of(rectangle);
    Image<std::uint8_t> lit(projector_.width, projector_.height, 1);
    for (int y = box.top; y < box.bottom; ++y) {
      for (int x = box.left; x < box.right; ++x) lit.at(x, y) = 1;
    }
    return lit;
  }

  Image<float> irradiance(const Image<std::uint8_t>& codes) const override;

 private:
  /// Ends at the pixels' nearest edges.
  PixelRectangle pixels_of(const LitRectangle& r) const {
    constexpr double kFar = 1e9;  // outside every picture, and an int
    const auto at = [&](double offset, double mm) {
      return static_cast<int>(
          std::lround(std::clamp(offset + mm / projector_.mm_per_pixel, -kFar, kFar)));
    };
    return {at(projector_.offset_x_px, r.left),
            at(projector_.offset_y_px, r.top),
            at(projector_.offset_x_px, r.left + r.width),
            at(projector_.offset_y_px, r.top + r.height)};
  }

  const Block block_;
  const Face face_;
  const ProjectorCalibration projector_;
};

Image<float> PerpendicularLight::irradiance(const Image<std::uint8_t>& codes) const {
  const ProjectorCalibration& p = projector_;
  const int width = block_.face_width(face_);
  const int height = block_.face_height(face_);
  const CellSize cell = face_cell_size(block_, face_);
  const auto columns = overlaps(p.width, p.offset_x_px, p.mm_per_pixel, width, cell.width);
  const auto rows = overlaps(p.height, p.offset_y_px, p.mm_per_pixel, height, cell.height);
  std::array<double, 256> light{};
  for (int code = 0; code < 256; ++code) light[static_cast<std::size_t>(code)] = p.light_of(code);
  Image<double> sum(width, height, 3);
  for (int y = 0; y < codes.height(); ++y) {
    for (int x = 0; x < codes.width(); ++x) {
      const double falloff = p.vignetting_at(x, y);
      for (int c = 0; c < 3; ++c) {
        if (codes.at(x, y, c) == 0) continue;
        const double e =
            p.peak_irradiance[static_cast<std::size_t>(c)] * falloff * light[codes.at(x, y, c)];
        for (const Overlap& row : rows[static_cast<std::size_t>(y)]) {
          for (const Overlap& column : columns[static_cast<std::size_t>(x)]) {
            sum.at(column.cell, row.cell, c) += e * row.share * column.share;
          }
        }
      }
    }
  }
  Image<float> irradiance(width, height, 3);
  std::ranges::transform(
      sum.samples(), irradiance.samples().begin(), [](double e) { return static_cast<float>(e); });
  return irradiance;
}

}  // namespace

std::unique_ptr<FaceLight> make_face_light(const Block& block,
                                           Face lit_face,
                                           const ProjectorCalibration& projector) {
  if (projector.kind == ProjectorKind::kPerspective)
    return make_perspective_light(block, lit_face, projector);
  return std::make_unique<PerpendicularLight>(block, lit_face, projector);
}

}  // namespace opaline::capture
