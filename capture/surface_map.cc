#include "capture/surface_map.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <string>
#include <utility>

#include "capture/face_geometry.h"

namespace opaline::capture {
namespace {

using Pixel = CameraModel::Pixel;

constexpr double kWhole = 1.0 - 1e-4;  // shares of a pixel add up to 1 but for rounding to float

// Of neighbours that are seen; from one of them where there is but one, and 0 with none.
double slope_between(const SurfaceRadiance& s,
                     int c,
                     std::array<int, 2> from,
                     std::array<int, 2> to) {
  const double steps = std::max(to[0] - from[0], to[1] - from[1]);
  if (steps == 0.0) return 0.0;
  return (s.radiance.at(to[0], to[1], c) - s.radiance.at(from[0], from[1], c)) / steps;
}

double usable_variance(const SurfaceRadiance& s) {
  double sum = 0.0;
  for (std::size_t i = 0; i < s.variance.samples().size(); ++i)
    if (s.mask.samples()[i / 3] != 0) sum += s.variance.samples()[i];
  return sum;
}

Error sees_nothing(Face face) {
  return invalid_argument(
      fmt::format("the camera sees nothing of face {}: is its pose right?", to_string(face)));
}

}  // namespace

void SurfaceMap::drop_partial_pixels(const CameraModel& camera) {
  Image<double> covered(camera.width, camera.height, 1);
  for (const Cell& cell : cells_) {
    for (const PixelShare& share : cell.pixels.shares) covered.at(share.x, share.y) += share.area;
  }
  footprint_ = Image<std::uint8_t>(camera.width, camera.height, 1);
  std::ranges::transform(covered.samples(), footprint_.samples().begin(), [](double c) {
    return static_cast<std::uint8_t>(c >= kWhole ? 1 : 0);
  });
  for (Cell& cell : cells_) {
    std::erase_if(cell.pixels.shares,
                  [&](const PixelShare& s) { return footprint_.at(s.x, s.y) == 0; });
  }
}

Result<SurfaceMap> SurfaceMap::create(const Block& block,
                                      Face face,
                                      const CameraModel& camera,
                                      const std::array<double, 36>& place_covariance) {
  if (auto direction = check_in_front(block, face, camera, "camera"); !direction)
    return direction.error();
  SurfaceMap map(face, block.face_width(face), block.face_height(face));
  map.view_ = view_of_face(block, face, camera.centre());
  for (int row = 0; row < map.height_; ++row) {
    for (int column = 0; column < map.width_; ++column) {
      map.cells_.push_back({pixels_of_cell(camera, block, face, column, row),
                            slip_of_cell(camera, block, face, column, row, place_covariance)});
    }
  }
  map.drop_partial_pixels(camera);
  const bool seen = std::ranges::any_of(map.footprint_.samples(), [](auto f) { return f != 0; });
  if (!seen) return sees_nothing(face);
  return map;
}

void SurfaceMap::add_light_slip(const Block& block,
                                Face lit_face,
                                const ProjectorCalibration& projector) {
  if (projector.kind != ProjectorKind::kPerspective || axis_of(lit_face) != axis_of(face_)) return;
  for (std::size_t i = 0; i < cells_.size(); ++i) {
    const auto column = static_cast<int>(i) % width_;
    const auto row = static_cast<int>(i) / width_;
    const PointVariance slip =
        slip_of_cell(projector.lens, block, lit_face, column, row, projector.place_covariance);
    cells_[i].place.column += slip.column;
    cells_[i].place.row += slip.row;
    cells_[i].place.both += slip.both;
  }
}

Result<void> SurfaceMap::check(const Block& block, Face face, const CameraModel& camera) {
  if (auto direction = check_in_front(block, face, camera, "camera"); !direction) return direction;
  for (int row = 0; row < block.face_height(face); ++row) {
    for (int column = 0; column < block.face_width(face); ++column) {
      const Pixel p = camera.project(face_point(block, face, column + 0.5, row + 0.5));
      if (p.x >= 0.0 && p.y >= 0.0 && p.x < camera.width && p.y < camera.height) return ok();
    }
  }
  return sees_nothing(face);
}

SurfaceRadiance SurfaceMap::apply(const HdrImage& hdr, double min_coverage) const {
  SurfaceRadiance surface{Image<float>(width_, height_, 3),
                          Image<float>(width_, height_, 3),
                          Image<std::uint8_t>(width_, height_, 1)};
  for (int row = 0; row < height_; ++row) {
    for (int column = 0; column < width_; ++column) {
      const Cell& cell = cells_[static_cast<std::size_t>(row) * width_ + column];
      double area = 0.0;
      double sum[3] = {};
      double squares[3] = {};
      for (const PixelShare& share : cell.pixels.shares) {
        if (hdr.mask.at(share.x, share.y) == 0) continue;
        const double a = share.area;
        area += a;
        for (int c = 0; c < 3; ++c) {
          sum[c] += a * hdr.radiance.at(share.x, share.y, c);
          squares[c] += a * a * hdr.variance.at(share.x, share.y, c);
        }
      }
      if (!(area > 0.0) || area < min_coverage * cell.pixels.area) continue;
      surface.mask.at(column, row) = 1;
      for (int c = 0; c < 3; ++c) {
        surface.radiance.at(column, row, c) = static_cast<float>(sum[c] / area);
        surface.variance.at(column, row, c) = static_cast<float>(squares[c] / (area * area));
      }
    }
  }
  const double own = usable_variance(surface);
  add_place_variance(surface);
  const double all = usable_variance(surface);
  surface.place_share = all > 0.0 ? 1.0 - own / all : 0.0;
  return surface;
}

void SurfaceMap::add_place_variance(SurfaceRadiance& surface) const {
  const auto seen = [&](int column, int row) {
    return column >= 0 && row >= 0 && column < width_ && row < height_ &&
           surface.mask.at(column, row) != 0;
  };
  for (int row = 0; row < height_; ++row) {
    for (int column = 0; column < width_; ++column) {
      const PointVariance& place = cells_[static_cast<std::size_t>(row) * width_ + column].place;
      if (!seen(column, row) || !(place.column + place.row > 0.0)) continue;
      const std::array left{seen(column - 1, row) ? column - 1 : column, row};
      const std::array right{seen(column + 1, row) ? column + 1 : column, row};
      const std::array above{column, seen(column, row - 1) ? row - 1 : row};
      const std::array below{column, seen(column, row + 1) ? row + 1 : row};
      for (int c = 0; c < 3; ++c) {
        const double across = slope_between(surface, c, left, right);
        const double down = slope_between(surface, c, above, below);
        surface.variance.at(column, row, c) +=
            static_cast<float>(across * across * place.column + down * down * place.row +
                               2.0 * across * down * place.both);
      }
    }
  }
}

double SurfaceMap::place_deviation() const {
  double most = 0.0;
  for (const Cell& cell : cells_) most = std::max({most, cell.place.column, cell.place.row});
  return std::sqrt(most);
}

}  // namespace opaline::capture
