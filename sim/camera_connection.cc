#include "sim/camera_connection.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "sim/fresnel.h"

namespace opaline::sim {
namespace {

constexpr int kMostIterations = 60;

double phase(double cosine, double g) {
  const double isotropic = 0.25 * std::numbers::inv_pi;
  if (g == 0.0) return isotropic;
  const double denominator = 1.0 + g * g - 2.0 * g * cosine;
  return isotropic * (1.0 - g * g) / (denominator * std::sqrt(denominator));
}

}  // namespace

RefractedRay refract_to_camera(double depth, double height, double lateral, double ior) {
  RefractedRay ray;
  double distance_squared = 0.0;
  double sine_outside = 0.0;
  for (int i = 0; i < kMostIterations; ++i) {  // contracts by about d / H a step
    const double outside = lateral - ray.lateral_inside;
    distance_squared = outside * outside + height * height;
    sine_outside = outside / std::sqrt(distance_squared);
    ray.sine_inside = sine_outside / ior;
    ray.cosine_inside = std::sqrt(1.0 - ray.sine_inside * ray.sine_inside);
    const double next = depth * ray.sine_inside / ray.cosine_inside;
    const double change = std::abs(next - ray.lateral_inside);
    ray.lateral_inside = next;
    if (change <= 1e-6 * height) break;
  }
  ray.distance_outside = std::sqrt(distance_squared);
  ray.cosine_outside = height / ray.distance_outside;
  const double ci = ray.cosine_inside;
  const double co = ray.cosine_outside;
  const double across = depth / ci + ior * height / co;
  const double along = depth / (ci * ci) + ior * height * ci / (co * co * co);
  ray.solid_angle_per_area = 1.0 / (co * across * along);
  return ray;
}

CameraConnection::CameraConnection(const LightTransportMedium& medium, Face seen, Vec3 centre)
    : medium_(medium),
      seen_(seen),
      size_{medium.block.size().x, medium.block.size().y, medium.block.size().z},
      camera_{centre.x, centre.y, centre.z},
      spacing_(medium.block.spacing()),
      cells_(medium.block.cells()),
      normal_(axis_of(seen)),
      column_axis_(normal_ == 0 ? 1 : 0),
      row_axis_(normal_ == 2 ? 1 : 2),
      height_(is_max(seen) ? camera_[normal_] - size_[normal_] : -camera_[normal_]) {
  double farthest_squared = 0.0;
  for (const int axis : {column_axis_, row_axis_}) {
    const double farthest =
        std::max(std::abs(camera_[axis]), std::abs(camera_[axis] - size_[axis])) + size_[axis];
    farthest_squared += farthest * farthest;
  }
  const double sine =
      std::sqrt(farthest_squared / (farthest_squared + height_ * height_)) / medium.ior;
  reach_ = sine < 1.0 ? sine / std::sqrt(1.0 - sine * sine) : std::numeric_limits<double>::max();
}

void CameraConnection::connect(const std::array<double, 3>& point,
                               const std::array<double, 3>& direction,
                               double weight,
                               double random,
                               std::span<double> radiance) const {
  Image direct{.point = point};
  add_image(direct, direction, weight, radiance);
  if (medium_.ior == 1.0) return;  // nothing reflects
  const double depth = is_max(seen_) ? size_[normal_] - point[normal_] : point[normal_];
  // Sides: mirror images from which a ray can still reach the face, singly and both at once.
  std::array<double, 3> column{point[column_axis_]};
  std::array<double, 3> row{point[row_axis_]};
  std::size_t columns = 1;
  std::size_t rows = 1;
  if (!medium_.periodic_sides) {
    const double near = depth * reach_;
    const auto mirrors = [&](int axis, std::array<double, 3>& images, std::size_t& count) {
      if (point[axis] < near) images[count++] = -point[axis];
      if (size_[axis] - point[axis] < near) images[count++] = 2.0 * size_[axis] - point[axis];
    };
    mirrors(column_axis_, column, columns);
    mirrors(row_axis_, row, rows);
  }
  for (std::size_t r = 0; r < rows; ++r) {
    for (std::size_t c = r == 0 ? 1 : 0; c < columns; ++c) {
      Image image{.point = point};
      image.point[column_axis_] = column[c];
      image.point[row_axis_] = row[r];
      if (c > 0) image.mirrors |= 1 << column_axis_;
      if (r > 0) image.mirrors |= 1 << row_axis_;
      add_image(image, direction, weight, radiance);
    }
  }
  // The face opposite: the way down and up again is long; make it as seldom as it is dark.
  const double below = size_[normal_] - depth;
  const double chance = std::exp(-2.0 * below * medium_.least_extinction);
  if (random >= chance) return;
  Image image{.point = point};
  image.point[normal_] = is_max(seen_) ? -point[normal_] : 2.0 * size_[normal_] - point[normal_];
  image.mirrors = 1 << normal_;
  add_image(image, direction, weight / chance, radiance);
}

void CameraConnection::add_image(const Image& image,
                                 const std::array<double, 3>& direction,
                                 double weight,
                                 std::span<double> radiance) const {
  const double depth = is_max(seen_) ? size_[normal_] - image.point[normal_] : image.point[normal_];
  const double dx = camera_[column_axis_] - image.point[column_axis_];
  const double dy = camera_[row_axis_] - image.point[row_axis_];
  const double lateral = std::sqrt(dx * dx + dy * dy);
  const RefractedRay ray = refract_to_camera(depth, height_, lateral, medium_.ior);
  const double unit_x = lateral > 0.0 ? dx / lateral : 1.0;
  const double unit_y = lateral > 0.0 ? dy / lateral : 0.0;
  double column =
      (image.point[column_axis_] + unit_x * ray.lateral_inside) / spacing_[column_axis_];
  double row = (image.point[row_axis_] + unit_y * ray.lateral_inside) / spacing_[row_axis_];
  const int width = cells_[column_axis_];
  const int height = cells_[row_axis_];
  if (medium_.periodic_sides) {
    column -= width * std::floor(column / width);
    row -= height * std::floor(row / height);
  }
  if (column < 0.0 || row < 0.0 || column >= width || row >= height) return;

  std::array<double, 3> out{};  // unit direction of the unfolded ray
  out[column_axis_] = ray.sine_inside * unit_x;
  out[row_axis_] = ray.sine_inside * unit_y;
  out[normal_] = is_max(seen_) ? ray.cosine_inside : -ray.cosine_inside;
  double factor = 1.0 - reflectance(ray.cosine_inside, medium_.ior, 1.0);
  double cosine = 0.0;  // of the scattering angle, towards the first mirror
  for (int axis = 0; axis < 3; ++axis) {
    const bool mirrored = (image.mirrors >> axis & 1) != 0;
    if (mirrored) factor *= reflectance(std::abs(out[axis]), medium_.ior, 1.0);
    cosine += direction[axis] * (mirrored ? -out[axis] : out[axis]);
  }
  factor *= transmittance(image.point, out, depth / ray.cosine_inside);
  const double area = spacing_[column_axis_] * spacing_[row_axis_];
  const double geometry = ray.solid_angle_per_area * ray.distance_outside * ray.distance_outside /
                          (area * ray.cosine_outside);
  radiance[static_cast<std::size_t>(row) * width + static_cast<std::size_t>(column)] +=
      weight * phase(cosine, medium_.anisotropy) * factor * geometry;
}

double CameraConnection::transmittance(const std::array<double, 3>& from,
                                       const std::array<double, 3>& direction,
                                       double length) const {
  // Exact for constant voxels: from plane to plane (Amanatides & Woo 1987), folding mirrored cells
  // back.
  std::array<int, 3> cell{};
  std::array<int, 3> step{};
  std::array<double, 3> next{};
  std::array<double, 3> every{};
  for (int axis = 0; axis < 3; ++axis) {
    const double position = from[axis] / spacing_[axis];
    cell[axis] = static_cast<int>(std::floor(position));
    step[axis] = direction[axis] > 0.0 ? 1 : -1;
    const double edge = direction[axis] > 0.0 ? cell[axis] + 1.0 - position : position - cell[axis];
    const double speed = std::abs(direction[axis]);
    every[axis] = speed > 0.0 ? spacing_[axis] / speed : std::numeric_limits<double>::max();
    next[axis] = speed > 0.0 ? edge * every[axis] : std::numeric_limits<double>::max();
  }
  double optical_depth = 0.0;
  double at = 0.0;
  while (at < length) {
    const int axis = next[0] < next[1] ? (next[0] < next[2] ? 0 : 2) : (next[1] < next[2] ? 1 : 2);
    const double to = std::min(next[axis], length);
    optical_depth += (to - at) * medium_.extinction(folded_cell(cell));
    at = to;
    next[axis] += every[axis];
    cell[axis] += step[axis];
  }
  return std::exp(-optical_depth);
}

std::size_t CameraConnection::folded_cell(std::array<int, 3> cell) const {
  for (int axis = 0; axis < 3; ++axis) {
    const int count = cells_[axis];
    int& i = cell[axis];
    if (i >= 0 && i < count) continue;
    if (medium_.periodic_sides && axis != 2) {
      i = (i % count + count) % count;
    } else {
      i = std::clamp(i < 0 ? -1 - i : 2 * count - 1 - i, 0, count - 1);
    }
  }
  return medium_.block.index(cell[0], cell[1], cell[2]);
}

}  // namespace opaline::sim
