#include "sim/lit_face.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace opaline::sim {
namespace {

struct FaceAxes {
  int column;
  int row;
  int normal;
  double plane;    ///< of the face along its normal
  double outward;  ///< sign of its normal
};

FaceAxes axes_of(const Block& block, Face face) {
  const int normal = axis_of(face);
  const std::array size{block.size().x, block.size().y, block.size().z};
  return {normal == 0 ? 1 : 0,
          normal == 2 ? 1 : 2,
          normal,
          is_max(face) ? size[static_cast<std::size_t>(normal)] : 0.0,
          is_max(face) ? 1.0 : -1.0};
}

double along(Vec3 v, int axis) { return axis == 0 ? v.x : axis == 1 ? v.y : v.z; }

Vec3 point_at(const FaceAxes& axes, double column, double row) {
  std::array<double, 3> p{};
  p[static_cast<std::size_t>(axes.column)] = column;
  p[static_cast<std::size_t>(axes.row)] = row;
  p[static_cast<std::size_t>(axes.normal)] = axes.plane;
  return {p[0], p[1], p[2]};
}

/// Pixels along one axis that a rectangle covers, and how much of each.
struct Coverage {
  int first = 0;
  std::vector<double> share;
};

Coverage coverage(double from, double to, int size) {
  Coverage covered;
  covered.first = std::clamp(static_cast<int>(std::floor(from)), 0, size);
  const int end = std::clamp(static_cast<int>(std::ceil(to)), covered.first, size);
  for (int i = covered.first; i < end; ++i) {
    covered.share.push_back(std::max(0.0, std::min(to, i + 1.0) - std::max(from, 1.0 * i)));
  }
  return covered;
}

}  // namespace

FacePlace lit_by(
    const ProjectorOptics& projector, const Block& block, Face lit_face, double x, double y) {
  if (projector.kind == ProjectorKind::kPerpendicular) {
    return {(x - projector.offset_x_px) * projector.mm_per_pixel,
            (y - projector.offset_y_px) * projector.mm_per_pixel};
  }
  const FaceAxes axes = axes_of(block, lit_face);
  const Vec3 lamp = projector.lens.centre();
  const Vec3 ray = projector.lens.ray_direction({x, y});
  const double t = (axes.plane - along(lamp, axes.normal)) / along(ray, axes.normal);
  const Vec3 hit = lamp + ray * t;
  return {along(hit, axes.column), along(hit, axes.row)};
}

LitFace::LitFace(
    const ProjectorOptics& projector, const Block& block, Face lit_face, int across, int down)
    : projector_(projector),
      vignetting_(vignetting_map(projector.width, projector.height, projector.vignetting)) {
  projector.kind == ProjectorKind::kPerpendicular ? cover(block, lit_face, across, down)
                                                  : sample(block, lit_face, across, down);
  first_share_.push_back(shares_.size());
}

void LitFace::cover(const Block& block, Face lit_face, int across, int down) {
  const FaceAxes axes = axes_of(block, lit_face);
  const double width_px = along(block.size(), axes.column) / projector_.mm_per_pixel / across;
  const double height_px = along(block.size(), axes.row) / projector_.mm_per_pixel / down;
  for (int row = 0; row < down; ++row) {
    const double top = projector_.offset_y_px + row * height_px;
    const Coverage rows = coverage(top, top + height_px, projector_.height);
    for (int column = 0; column < across; ++column) {
      const double left = projector_.offset_x_px + column * width_px;
      const Coverage columns = coverage(left, left + width_px, projector_.width);
      first_share_.push_back(shares_.size());
      for (std::size_t j = 0; j < rows.share.size(); ++j) {
        for (std::size_t i = 0; i < columns.share.size(); ++i) {
          const std::size_t pixel = (rows.first + j) * projector_.width + columns.first + i;
          shares_.push_back(
              {static_cast<std::uint32_t>(pixel),
               static_cast<float>(rows.share[j] * columns.share[i] / (width_px * height_px))});
        }
      }
    }
  }
}

void LitFace::sample(const Block& block, Face lit_face, int across, int down) {
  const FaceAxes axes = axes_of(block, lit_face);
  const CameraModel& lens = projector_.lens;
  const Vec3 lamp = lens.centre();
  const double width = along(block.size(), axes.column) / across;
  const double height = along(block.size(), axes.row) / down;
  const double away = std::abs(along(lamp, axes.normal) - axes.plane);
  const double pixel_mm = away / std::max(lens.fx, lens.fy);
  const int points =
      std::max(2, static_cast<int>(std::ceil(2.0 * std::max(width, height) / pixel_mm)));
  for (int i = 0; i < across * down; ++i) {
    first_share_.push_back(shares_.size());
    const int across_at = i % across;
    const int down_at = i / across;
    for (int k = 0; k < points * points; ++k) {
      const int point_column = k % points;
      const int point_row = k / points;
      const double column = (across_at + (point_column + 0.5) / points) * width;
      const double row = (down_at + (point_row + 0.5) / points) * height;
      const Vec3 there = point_at(axes, column, row);
      const Vec3 to_lamp = lamp - there;
      const double distance = length(to_lamp);
      const double cosine = axes.outward * along(to_lamp, axes.normal) / distance;
      if (cosine <= 0.0 || !lens.faces(there)) continue;
      const auto p = lens.project(there);
      if (!(p.x >= 0.0 && p.y >= 0.0 && p.x < lens.width && p.y < lens.height)) continue;
      const double nearer = projector_.reference_distance_mm / distance;
      const auto pixel =
          static_cast<std::uint32_t>(p.y) * lens.width + static_cast<std::uint32_t>(p.x);
      shares_.push_back(
          {pixel, static_cast<float>(nearer * nearer * cosine / (1.0 * points * points))});
    }
  }
}

std::vector<Rgb> LitFace::irradiance(const Image<std::uint8_t>& codes) const {
  const std::array<float, 256> light = light_of_codes(projector_);
  std::vector<Rgb> all(first_share_.size() - 1);
  for (std::size_t i = 0; i < all.size(); ++i) {
    for (std::size_t s = first_share_[i]; s < first_share_[i + 1]; ++s) {
      const std::size_t pixel = shares_[s].pixel;
      const double weight = shares_[s].weight * vignetting_.samples()[pixel];
      for (std::size_t c = 0; c < 3; ++c)
        all[i][c] += weight * light[codes.samples()[3 * pixel + c]];
    }
    for (std::size_t c = 0; c < 3; ++c) all[i][c] *= projector_.peak_irradiance[c];
  }
  return all;
}

}  // namespace opaline::sim
