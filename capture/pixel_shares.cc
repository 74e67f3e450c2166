#include "capture/pixel_shares.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

#include "capture/face_geometry.h"

namespace opaline::capture {
namespace {

using Pixel = CameraModel::Pixel;
using Polygon = std::vector<Pixel>;

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

Vec3 column_axis(Face face) { return axis_of(face) == 0 ? Vec3{0, 1, 0} : Vec3{1, 0, 0}; }
Vec3 row_axis(Face face) { return axis_of(face) == 2 ? Vec3{0, 1, 0} : Vec3{0, 0, 1}; }

// How the point that a ray meets on the face moves with each of the six motions: along columns and rows, mm.
std::array<std::array<double, 6>, 2> slides(const CameraModel& lens, Face face, Vec3 point) {
  const Pose& place = lens.camera_from_sample;
  const Pose back = place.inverse();
  const Vec3 turned = place.rotate(point);
  const Vec3 ray = normalized(point - lens.centre());
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

}  // namespace

// The face is flat, so that its corners tell for all of it.
Result<void> check_in_front(const Block& block,
                            Face face,
                            const CameraModel& lens,
                            std::string_view name) {
  const Vec3 eye = lens.centre();
  if (!(dot(outward_normal(face), eye - face_point(block, face, 0.0, 0.0)) > 0.0)) {
    return invalid_argument(
        fmt::format("the {} at ({:.1f}, {:.1f}, {:.1f}) mm is not in front of face {}",
                    name,
                    eye.x,
                    eye.y,
                    eye.z,
                    to_string(face)));
  }
  const double width = block.face_width(face);
  const double height = block.face_height(face);
  for (const auto& [u, v] : {std::pair{0.0, 0.0}, {width, 0.0}, {width, height}, {0.0, height}}) {
    if (lens.faces(face_point(block, face, u, v))) continue;
    return invalid_argument(
        fmt::format("the {0} looks away from face {1}: expected a pose whose +Z axis points at "
                    "the sample ({0}_from_sample, as OpenCV has it)",
                    name,
                    to_string(face)));
  }
  return ok();
}

CellPixels pixels_of_cell(
    const CameraModel& lens, const Block& block, Face face, int column, int row) {
  const Polygon corners{lens.project(face_point(block, face, column, row)),
                        lens.project(face_point(block, face, column + 1, row)),
                        lens.project(face_point(block, face, column + 1, row + 1)),
                        lens.project(face_point(block, face, column, row + 1))};
  const auto [left, right] = std::ranges::minmax(corners, {}, &Pixel::x);
  const auto [top, bottom] = std::ranges::minmax(corners, {}, &Pixel::y);
  const Span columns = pixels_between(left.x, right.x, lens.width);
  const Span rows = pixels_between(top.y, bottom.y, lens.height);
  CellPixels cell{{}, area_of(corners)};
  Polygon work;
  Polygon scratch;
  for (int y = rows.first; y < rows.last; ++y) {
    for (int x = columns.first; x < columns.last; ++x) {
      const double area = shared_area(corners, x, y, work, scratch);
      if (area > 0.0) cell.shares.push_back({x, y, static_cast<float>(area)});
    }
  }
  return cell;
}

PointVariance slip_of_cell(const CameraModel& lens,
                           const Block& block,
                           Face face,
                           int column,
                           int row,
                           const std::array<double, 36>& place_covariance) {
  const auto slide = slides(lens, face, block.face_cell_centre(face, column, row));
  const auto [width, height] = face_cell_size(block, face);
  return {carried(slide[0], place_covariance, slide[0]) / (width * width),
          carried(slide[1], place_covariance, slide[1]) / (height * height),
          carried(slide[0], place_covariance, slide[1]) / (width * height)};
}

}  // namespace opaline::capture
