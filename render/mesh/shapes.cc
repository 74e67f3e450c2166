#include "render/mesh/shapes.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>

namespace opaline::render {
namespace {

class Shape final : public SignedDistance {
 public:
  Shape(std::function<double(Vec3)> distance, Vec3 half)
      : distance_(std::move(distance)), half_(half) {}
  double at(Vec3 point) const override { return distance_(point); }
  Box bounds() const override { return {half_ * -1.0, half_}; }

 private:
  std::function<double(Vec3)> distance_;
  Vec3 half_;
};

double box(Vec3 p, Vec3 half) {
  const Vec3 q{std::abs(p.x) - half.x, std::abs(p.y) - half.y, std::abs(p.z) - half.z};
  const Vec3 outside{std::max(q.x, 0.0), std::max(q.y, 0.0), std::max(q.z, 0.0)};
  return length(outside) + std::min(std::max({q.x, q.y, q.z}), 0.0);
}

double capsule(Vec3 p, Vec3 a, Vec3 b, double radius) {
  const Vec3 ab = b - a;
  const double t = std::clamp(dot(p - a, ab) / dot(ab, ab), 0.0, 1.0);
  return length(p - (a + ab * t)) - radius;
}

/// A union with its seam rounded over k; changes no faster than its parts.
double blend(double a, double b, double k) {
  const double h = std::max(k - std::abs(a - b), 0.0);
  return std::min(a, b) - h * h / (4.0 * k);
}

double torus(Vec3 p, double ring, double tube) {
  return std::hypot(std::hypot(p.x, p.y) - ring, p.z) - tube;
}

double genus3(Vec3 p, double s) {
  double d = box(p, {0.5 * s, 0.5 * s, 0.125 * s});
  constexpr std::array<std::array<double, 2>, 3> holes{{{-0.22, -0.2}, {0.22, -0.2}, {0.0, 0.22}}};
  for (const auto& hole : holes)
    d = std::max(d, 0.13 * s - std::hypot(p.x - hole[0] * s, p.y - hole[1] * s));
  return d;
}

std::function<double(Vec3)> knot(double s) {
  constexpr int kPieces = 160;
  std::vector<Vec3> curve;
  for (int i = 0; i <= kPieces; ++i) {
    const double t = 2.0 * std::numbers::pi * i / kPieces;
    const double scale = s / 7.0;
    curve.push_back(Vec3{std::sin(t) + 2.0 * std::sin(2.0 * t),
                         std::cos(t) - 2.0 * std::cos(2.0 * t),
                         -std::sin(3.0 * t)} *
                    scale);
  }
  return [curve, s](Vec3 p) {
    double d = std::numeric_limits<double>::infinity();
    for (int i = 0; i < kPieces; ++i) d = std::min(d, capsule(p, curve[i], curve[i + 1], 0.0));
    return d - s / 16.0;
  };
}

double figurine(Vec3 p, double s) {
  const Vec3 q{std::abs(p.x) / s, p.y / s, p.z / s};  // left and right alike
  double d = capsule(q, {0.0, 0.0, -0.2}, {0.0, 0.0, 0.06}, 0.15);
  d = blend(d, length(q - Vec3{0.0, -0.02, 0.3}) - 0.13, 0.08);
  d = blend(d, capsule(q, {0.08, -0.04, 0.38}, {0.14, -0.02, 0.46}, 0.03), 0.04);
  d = blend(d, capsule(q, {0.14, -0.02, 0.1}, {0.28, -0.16, -0.06}, 0.05), 0.05);
  d = blend(d, capsule(q, {0.28, -0.16, -0.06}, {0.2, -0.3, 0.08}, 0.04), 0.03);
  d = blend(d, capsule(q, {0.1, -0.02, -0.28}, {0.22, -0.34, -0.34}, 0.08), 0.06);
  d = blend(d, capsule(q, {0.0, 0.12, -0.3}, {0.0, 0.34, -0.2}, 0.03), 0.05);
  return d * s;
}

struct Named {
  std::string_view name;
  std::unique_ptr<SignedDistance> (*make)(double size);
};

template <class Distance>
std::unique_ptr<SignedDistance> shape(Distance distance, Vec3 half) {
  return std::make_unique<Shape>(std::move(distance), half);
}

constexpr std::array kShapes{
    Named{"sphere",
          [](double s) {
            return shape([s](Vec3 p) { return length(p) - 0.5 * s; }, Vec3{0.5, 0.5, 0.5} * s);
          }},
    Named{"torus",
          [](double s) {
            return shape([s](Vec3 p) { return torus(p, 0.375 * s, 0.125 * s); },
                         Vec3{0.5, 0.5, 0.125} * s);
          }},
    Named{"genus3",
          [](double s) {
            return shape([s](Vec3 p) { return genus3(p, s); }, Vec3{0.5, 0.5, 0.125} * s);
          }},
    Named{"knot",
          [](double s) {
            return shape(knot(s), Vec3{0.5, 0.5, 0.25} * s);
          }},
    Named{"figurine",
          [](double s) {
            return shape([s](Vec3 p) { return figurine(p, s); }, Vec3{0.5, 0.5, 0.5} * s);
          }},
    Named{"sheet",
          [](double s) {
            const Vec3 half = Vec3{0.5, 0.5, 0.0125} * s;
            return shape([half](Vec3 p) { return box(p, half); }, half);
          }},
};

}  // namespace

std::vector<std::string_view> shape_names() {
  std::vector<std::string_view> names;
  names.reserve(kShapes.size());
  for (const Named& named : kShapes) names.push_back(named.name);
  return names;
}

Result<std::unique_ptr<SignedDistance>> make_shape(std::string_view name, double size_mm) {
  if (!(size_mm > 0.0) || !std::isfinite(size_mm)) {
    return invalid_argument(fmt::format("a shape {} mm across; expected > 0", size_mm));
  }
  for (const Named& named : kShapes) {
    if (named.name == name) return named.make(size_mm);
  }
  return invalid_argument(
      fmt::format("\"{}\" is no shape; there are {}", name, fmt::join(shape_names(), ", ")));
}

}  // namespace opaline::render
