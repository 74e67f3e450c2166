#include "sim/camera_connection.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "sim/fresnel.h"

namespace opaline::sim {
namespace {

constexpr int kMostIterations = 20;
constexpr double kSlowest = 1e-30;     // a direction component that never reaches the next voxel
constexpr double kSmallChange = 1e-4;  // Newton's next error is its square

double phase(double cosine, double g) {
  const double isotropic = 0.25 * std::numbers::inv_pi;
  if (g == 0.0) return isotropic;
  const double denominator = 1.0 + g * g - 2.0 * g * cosine;
  return isotropic * (1.0 - g * g) / (denominator * std::sqrt(denominator));
}

}  // namespace

RefractedRay refract_to_camera(double depth, double height, double lateral_squared, double ior) {
  const double k = depth / height;
  const double q = lateral_squared / (height * height);
  const double n2 = ior * ior;
  double rho = k / (ior + k);  // exact straight above
  for (int i = 0; i < kMostIterations; ++i) {
    const double s = 1.0 - rho;
    const double d2 = n2 + (n2 - 1.0) * q * s * s;
    const double inverse = 1.0 / std::sqrt(d2);
    const double change = (rho - k * s * inverse) / (1.0 + k * n2 * inverse * inverse * inverse);
    rho -= change;
    if (std::abs(change) < kSmallChange) break;
  }
  const double s = 1.0 - rho;
  const double stretch = std::sqrt(1.0 + q * s * s);
  const double d = std::sqrt(n2 + (n2 - 1.0) * q * s * s);
  RefractedRay ray{.share_inside = rho,
                   .cosine_inside = d / (ior * stretch),
                   .cosine_outside = 1.0 / stretch,
                   .distance_outside = height * stretch};
  const double ci = ray.cosine_inside;
  const double across = depth / ci + ior * height * stretch;
  const double along = depth / (ci * ci) + ior * height * ci * stretch * stretch * stretch;
  ray.solid_angle_per_area = stretch / (across * along);
  return ray;
}

CameraConnection::CameraConnection(const LightTransportMedium& medium, Face seen, Vec3 centre)
    : medium_(medium),
      seen_(seen),
      size_{medium.block.size().x, medium.block.size().y, medium.block.size().z},
      camera_{centre.x, centre.y, centre.z},
      spacing_(medium.block.spacing()),
      inverse_spacing_{1.0 / spacing_[0], 1.0 / spacing_[1], 1.0 / spacing_[2]},
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
  const double thickness = 2.0 * below * medium_.least_extinction;
  if (random * (1.0 + thickness) >= 1.0) return;  // e^-t <= 1 / (1 + t) spares most exponentials
  const double chance = std::exp(-thickness);
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
  const RefractedRay ray = refract_to_camera(depth, height_, dx * dx + dy * dy, medium_.ior);
  const double share = ray.share_inside;
  double column = (image.point[column_axis_] + dx * share) / spacing_[column_axis_];
  double row = (image.point[row_axis_] + dy * share) / spacing_[row_axis_];
  const int width = cells_[column_axis_];
  const int height = cells_[row_axis_];
  if (medium_.periodic_sides) {
    column -= width * std::floor(column / width);
    row -= height * std::floor(row / height);
  }
  if (column < 0.0 || row < 0.0 || column >= width || row >= height) return;

  std::array<double, 3> out{};  // unit direction of the unfolded ray
  const double sine_by_distance = (1.0 - share) / (medium_.ior * ray.distance_outside);
  out[column_axis_] = dx * sine_by_distance;
  out[row_axis_] = dy * sine_by_distance;
  out[normal_] = is_max(seen_) ? ray.cosine_inside : -ray.cosine_inside;
  double factor = 1.0 - reflectance_between(ray.cosine_inside, ray.cosine_outside, medium_.ior);
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
  // Exact for constant voxels: from plane to plane (Amanatides & Woo 1987), folding mirrored cells back.
  std::array<int, 3> cell{};
  std::array<int, 3> step{};
  std::array<double, 3> next{};
  std::array<double, 3> every{};
  for (int axis = 0; axis < 3; ++axis) {
    const double position = from[axis] * inverse_spacing_[axis];
    const int truncated = static_cast<int>(position);
    cell[axis] = position < truncated ? truncated - 1 : truncated;
    const bool forwards = direction[axis] > 0.0;
    step[axis] = forwards ? 1 : -1;
    const double speed = std::abs(direction[axis]);
    every[axis] = spacing_[axis] / std::max(speed, kSlowest);
    const double edge = forwards ? cell[axis] + 1.0 - position : position - cell[axis];
    next[axis] = speed > kSlowest ? edge * every[axis] : every[axis];
  }
  double optical_depth = 0.0;
  double at = 0.0;
  while (true) {
    const int axis = next[0] < next[1] ? (next[0] < next[2] ? 0 : 2) : (next[1] < next[2] ? 1 : 2);
    const double accept = medium_.voxels[folded_cell(cell)].accept;
    if (next[axis] >= length) {
      return std::exp(-medium_.majorant * (optical_depth + (length - at) * accept));
    }
    optical_depth += (next[axis] - at) * accept;
    at = next[axis];
    next[axis] += every[axis];
    cell[axis] += step[axis];
  }
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
