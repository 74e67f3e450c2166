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
using Polygon = std::vector<Pixel>;

constexpr double kWhole = 1.0 - 1e-4;  // shares of a pixel add up to 1 but for rounding to float

double area_of(const Polygon& polygon) {
  double twice = 0.0;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Pixel& p = polygon[i];
    const Pixel& q = polygon[(i + 1) % polygon.size()];
    twice += p.x * q.y - q.x * p.y;
  }
  return 0.5 * std::abs(twice);
}

// The part of a convex polygon where distance(point) >= 0, linear in the point (Sutherland and
// Hodgman 1974).
template <class Distance>
void clip(Polygon& polygon, Polygon& scratch, Distance distance) {
  scratch.clear();
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Pixel& p = polygon[i];
    const Pixel& q = polygon[(i + 1) % polygon.size()];
    const double dp = distance(p);
    const double dq = distance(q);
    if (dp >= 0.0) scratch.push_back(p);
    if ((dp >= 0.0) == (dq >= 0.0)) continue;
    const double t = dp / (dp - dq);
    scratch.push_back({p.x + t * (q.x - p.x), p.y + t * (q.y - p.y)});
  }
  polygon.swap(scratch);
}

double shared_area(const Polygon& quad, int x, int y, Polygon& work, Polygon& scratch) {
  work = quad;
  clip(work, scratch, [&](const Pixel& p) { return p.x - x; });
  clip(work, scratch, [&](const Pixel& p) { return x + 1.0 - p.x; });
  clip(work, scratch, [&](const Pixel& p) { return p.y - y; });
  clip(work, scratch, [&](const Pixel& p) { return y + 1.0 - p.y; });
  return area_of(work);
}

struct Span {
  int first = 0;
  int last = 0;  // one past
};

Span pixels_between(double low, double high, int size) {
  const double limit = size;
  return {static_cast<int>(std::clamp(std::floor(low), 0.0, limit)),
          static_cast<int>(std::clamp(std::ceil(high), 0.0, limit))};
}

// The face is flat, so that its corners tell for all of it.
Result<void> check_direction(const Block& block, Face face, const CameraModel& camera) {
  const Vec3 eye = camera.centre();
  if (!(dot(outward_normal(face), eye - face_point(block, face, 0.0, 0.0)) > 0.0)) {
    return invalid_argument(
        fmt::format("the camera at ({:.1f}, {:.1f}, {:.1f}) mm is not in front of face {}",
                    eye.x,
                    eye.y,
                    eye.z,
                    to_string(face)));
  }
  const double width = block.face_width(face);
  const double height = block.face_height(face);
  for (const auto& [u, v] : {std::pair{0.0, 0.0}, {width, 0.0}, {width, height}, {0.0, height}}) {
    if (camera.faces(face_point(block, face, u, v))) continue;
    return invalid_argument(
        fmt::format("the camera looks away from face {}: expected a pose whose +Z axis points at "
                    "the sample (camera_from_sample, as OpenCV has it)",
                    to_string(face)));
  }
  return ok();
}

Vec3 column_axis(Face face) { return axis_of(face) == 0 ? Vec3{0, 1, 0} : Vec3{1, 0, 0}; }
Vec3 row_axis(Face face) { return axis_of(face) == 2 ? Vec3{0, 1, 0} : Vec3{0, 0, 1}; }

// How the point that a ray meets on the face moves with each of the six motions: along columns and rows, mm.
std::array<std::array<double, 6>, 2> slides(const CameraModel& camera, Face face, Vec3 point) {
  const Pose& place = camera.camera_from_sample;
  const Pose back = place.inverse();
  const Vec3 turned = place.rotate(point);
  const Vec3 ray = normalized(point - camera.centre());
  const Vec3 normal = outward_normal(face);
  constexpr std::array<Vec3, 3> kAxes{Vec3{1, 0, 0}, Vec3{0, 1, 0}, Vec3{0, 0, 1}};
  std::array<std::array<double, 6>, 2> slope{};
  for (std::size_t k = 0; k < 6; ++k) {
    const Vec3 motion = back.rotate(k < 3 ? cross(kAxes[k], turned) : kAxes[k - 3]);
    const Vec3 slid = ray * (dot(normal, motion) / dot(normal, ray)) - motion;
    slope[0][k] = dot(slid, column_axis(face));
    slope[1][k] = dot(slid, row_axis(face));
  }
  return slope;
}

double carried(const std::array<double, 6>& a,
               const std::array<double, 36>& covariance,
               const std::array<double, 6>& b) {
  double sum = 0.0;
  for (std::size_t i = 0; i < 6; ++i) {
    for (std::size_t j = 0; j < 6; ++j) sum += a[i] * covariance[6 * i + j] * b[j];
  }
  return sum;
}

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

void SurfaceMap::add_cell(const Polygon& corners, const CameraModel& camera) {
  const auto [left, right] = std::ranges::minmax(corners, {}, &Pixel::x);
  const auto [top, bottom] = std::ranges::minmax(corners, {}, &Pixel::y);
  const Span columns = pixels_between(left.x, right.x, camera.width);
  const Span rows = pixels_between(top.y, bottom.y, camera.height);
  Cell& cell = cells_.emplace_back();
  cell.area = area_of(corners);
  Polygon work;
  Polygon scratch;
  for (int y = rows.first; y < rows.last; ++y) {
    for (int x = columns.first; x < columns.last; ++x) {
      const double area = shared_area(corners, x, y, work, scratch);
      if (area > 0.0) cell.shares.push_back({x, y, static_cast<float>(area)});
    }
  }
}

void SurfaceMap::drop_partial_pixels(const CameraModel& camera) {
  Image<double> covered(camera.width, camera.height, 1);
  for (const Cell& cell : cells_) {
    for (const Share& share : cell.shares) covered.at(share.x, share.y) += share.area;
  }
  footprint_ = Image<std::uint8_t>(camera.width, camera.height, 1);
  std::ranges::transform(covered.samples(), footprint_.samples().begin(), [](double c) {
    return static_cast<std::uint8_t>(c >= kWhole ? 1 : 0);
  });
  for (Cell& cell : cells_) {
    std::erase_if(cell.shares, [&](const Share& s) { return footprint_.at(s.x, s.y) == 0; });
  }
}

Result<SurfaceMap> SurfaceMap::create(const Block& block,
                                      Face face,
                                      const CameraModel& camera,
                                      const std::array<double, 36>& place_covariance) {
  if (auto direction = check_direction(block, face, camera); !direction) return direction.error();
  SurfaceMap map(block.face_width(face), block.face_height(face));
  map.view_ = view_of_face(block, face, camera.centre());
  for (int row = 0; row < map.height_; ++row) {
    for (int column = 0; column < map.width_; ++column) {
      map.add_cell({camera.project(face_point(block, face, column, row)),
                    camera.project(face_point(block, face, column + 1, row)),
                    camera.project(face_point(block, face, column + 1, row + 1)),
                    camera.project(face_point(block, face, column, row + 1))},
                   camera);
      const auto slide = slides(camera, face, block.face_cell_centre(face, column, row));
      const auto [width, height] = face_cell_size(block, face);
      map.cells_.back().place = {carried(slide[0], place_covariance, slide[0]) / (width * width),
                                 carried(slide[1], place_covariance, slide[1]) / (height * height),
                                 carried(slide[0], place_covariance, slide[1]) / (width * height)};
    }
  }
  map.drop_partial_pixels(camera);
  const bool seen = std::ranges::any_of(map.footprint_.samples(), [](auto f) { return f != 0; });
  if (!seen) return sees_nothing(face);
  return map;
}

Result<void> SurfaceMap::check(const Block& block, Face face, const CameraModel& camera) {
  if (auto direction = check_direction(block, face, camera); !direction) return direction;
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
      for (const Share& share : cell.shares) {
        if (hdr.mask.at(share.x, share.y) == 0) continue;
        const double a = share.area;
        area += a;
        for (int c = 0; c < 3; ++c) {
          sum[c] += a * hdr.radiance.at(share.x, share.y, c);
          squares[c] += a * a * hdr.variance.at(share.x, share.y, c);
        }
      }
      if (!(area > 0.0) || area < min_coverage * cell.area) continue;
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
      const PlaceVariance& place = cells_[static_cast<std::size_t>(row) * width_ + column].place;
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
