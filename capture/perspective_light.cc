#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <vector>

#include "capture/face_geometry.h"
#include "capture/face_light.h"
#include "capture/pixel_shares.h"

namespace opaline::capture {
namespace {

using Pixel = CameraModel::Pixel;

struct FacePlace {  // mm from the corner where the face's raster begins
  double column = 0.0;
  double row = 0.0;
};

struct PixelBox {
  Pixel least;
  Pixel most;
};

class PerspectiveLight : public FaceLight {
 public:
  PerspectiveLight(const Block& block, Face lit_face, const ProjectorCalibration& projector)
      : block_(block), face_(lit_face), projector_(projector) {}

  Result<void> check(const LitRectangle& rectangle) const override;
  Image<std::uint8_t> pixels_on(const LitRectangle& rectangle) const override;
  Image<float> irradiance(const Image<std::uint8_t>& codes) const override;

 private:
  PixelBox box_of(const LitRectangle& rectangle) const;
  FacePlace place_lit_by(Pixel pixel) const;
  double falls_on(int column, int row) const;

  const Block block_;
  const Face face_;
  const ProjectorCalibration projector_;
  mutable std::vector<CellPixels> cells_;  // row by row; made when first asked for
};

// Of its corners and the middles of its sides: distortion bends them by less than a picture has to spare.
PixelBox PerspectiveLight::box_of(const LitRectangle& r) const {
  const CellSize cell = face_cell_size(block_, face_);
  std::array<Pixel, 9> seen{};
  for (std::size_t i = 0; i < seen.size(); ++i) {
    const std::size_t across = i % 3;
    const std::size_t down = i / 3;
    const double column = r.left + 0.5 * static_cast<double>(across) * r.width;
    const double row = r.top + 0.5 * static_cast<double>(down) * r.height;
    seen[i] =
        projector_.lens.project(face_point(block_, face_, column / cell.width, row / cell.height));
  }
  const auto [left, right] = std::ranges::minmax(seen, {}, &Pixel::x);
  const auto [top, bottom] = std::ranges::minmax(seen, {}, &Pixel::y);
  return {{left.x, top.y}, {right.x, bottom.y}};
}

Result<void> PerspectiveLight::check(const LitRectangle& rectangle) const {
  if (auto front = check_in_front(block_, face_, projector_.lens, "projector"); !front) {
    return invalid_argument(fmt::format(
        "{}. \"opaline calibrate\" measures a projector that is on the camera's side; for one that "
        "lights the sample from behind write calibration.projector.kind = \"perpendicular\" or "
        "calibration.use = \"given\" into the rig file",
        front.error().message));
  }
  const auto [least, most] = box_of(rectangle);
  if (!(least.x >= 0.0 && least.y >= 0.0 && most.x <= projector_.width &&
        most.y <= projector_.height)) {
    return invalid_argument(
        fmt::format("needs projector pixels x {:.0f} to {:.0f}, y {:.0f} to {:.0f}, and the "
                    "projector has {} x {}: expected a lit face within its picture",
                    least.x,
                    most.x,
                    least.y,
                    most.y,
                    projector_.width,
                    projector_.height));
  }
  if (most.x - least.x < 1.0 || most.y - least.y < 1.0)
    return invalid_argument("is smaller than a projector pixel: expected fewer regions");
  return ok();
}

FacePlace PerspectiveLight::place_lit_by(Pixel pixel) const {
  const Vec3 eye = projector_.lens.centre();
  const Vec3 ray = projector_.lens.ray_direction(pixel);
  const Vec3 corner = face_point(block_, face_, 0.0, 0.0);
  const Vec3 normal = outward_normal(face_);
  const Vec3 hit = eye + ray * (dot(normal, corner - eye) / dot(normal, ray));
  return {axis_of(face_) == 0 ? hit.y : hit.x, axis_of(face_) == 2 ? hit.y : hit.z};
}

Image<std::uint8_t> PerspectiveLight::pixels_on(const LitRectangle& r) const {
  constexpr int kBend = 2;  // pixels, for sides that are bent
  const auto [least, most] = box_of(r);
  const int left = std::max(0, static_cast<int>(std::floor(least.x)) - kBend);
  const int top = std::max(0, static_cast<int>(std::floor(least.y)) - kBend);
  const int right = std::min(projector_.width, static_cast<int>(std::ceil(most.x)) + kBend);
  const int bottom = std::min(projector_.height, static_cast<int>(std::ceil(most.y)) + kBend);
  Image<std::uint8_t> lit(projector_.width, projector_.height, 1);
  for (int y = top; y < bottom; ++y) {
    for (int x = left; x < right; ++x) {
      const FacePlace at = place_lit_by({x + 0.5, y + 0.5});
      const bool in = at.column >= r.left && at.row >= r.top && at.column < r.left + r.width &&
                      at.row < r.top + r.height;
      lit.at(x, y) = in ? 1 : 0;
    }
  }
  return lit;
}

// (reference / d)^2 cos(theta) at a cell's middle.
double PerspectiveLight::falls_on(int column, int row) const {
  const Vec3 to_lamp =
      projector_.lens.centre() - face_point(block_, face_, column + 0.5, row + 0.5);
  const double distance = length(to_lamp);
  const double nearer = projector_.reference_distance_mm / distance;
  return nearer * nearer * dot(outward_normal(face_), to_lamp) / distance;
}

Image<float> PerspectiveLight::irradiance(const Image<std::uint8_t>& codes) const {
  const int width = block_.face_width(face_);
  const int height = block_.face_height(face_);
  if (cells_.empty()) {
    for (int row = 0; row < height; ++row) {
      for (int column = 0; column < width; ++column)
        cells_.push_back(pixels_of_cell(projector_.lens, block_, face_, column, row));
    }
  }
  std::array<double, 256> light{};
  for (int code = 0; code < 256; ++code)
    light[static_cast<std::size_t>(code)] = projector_.light_of(code);
  Image<float> irradiance(width, height, 3);
  for (int row = 0; row < height; ++row) {
    for (int column = 0; column < width; ++column) {
      const CellPixels& cell = cells_[static_cast<std::size_t>(row) * width + column];
      std::array<double, 3> sum{};
      for (const PixelShare& share : cell.shares) {
        const double sent = share.area * projector_.vignetting_at(share.x, share.y);
        for (int c = 0; c < 3; ++c)
          sum[static_cast<std::size_t>(c)] += sent * light[codes.at(share.x, share.y, c)];
      }
      const double falls = falls_on(column, row) / cell.area;
      for (int c = 0; c < 3; ++c) {
        const auto channel = static_cast<std::size_t>(c);
        irradiance.at(column, row, c) =
            static_cast<float>(projector_.peak_irradiance[channel] * falls * sum[channel]);
      }
    }
  }
  return irradiance;
}

}  // namespace

std::unique_ptr<FaceLight> make_perspective_light(const Block& block,
                                                  Face lit_face,
                                                  const ProjectorCalibration& projector) {
  return std::make_unique<PerspectiveLight>(block, lit_face, projector);
}

}  // namespace opaline::capture
