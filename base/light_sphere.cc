#include "base/light_sphere.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "base/ensure.h"

namespace opaline {
namespace {

using std::numbers::pi;

/// A vertex at the top, five above the equator, five below, one at the bottom.
std::array<Vec3, 12> icosahedron() {
  std::array<Vec3, 12> vertices;
  vertices[0] = {0.0, 1.0, 0.0};
  vertices[11] = {0.0, -1.0, 0.0};
  const double height = 1.0 / std::sqrt(5.0);
  const double ring = 2.0 * height;
  for (std::size_t n = 0; n < 5; ++n) {
    const double upper = 2.0 * pi * static_cast<double>(n) / 5.0;
    const double lower = upper + pi / 5.0;
    vertices[1 + n] = {ring * std::cos(upper), height, ring * std::sin(upper)};
    vertices[6 + n] = {ring * std::cos(lower), -height, ring * std::sin(lower)};
  }
  return vertices;
}

std::vector<std::array<Vec3, 3>> faces() {
  const auto v = icosahedron();
  std::vector<std::array<Vec3, 3>> all;
  for (std::size_t n = 0; n < 5; ++n) {
    const std::size_t next = (n + 1) % 5;
    all.push_back({v[0], v[1 + n], v[1 + next]});
    all.push_back({v[1 + n], v[1 + next], v[6 + n]});
    all.push_back({v[1 + next], v[6 + n], v[6 + next]});
    all.push_back({v[11], v[6 + n], v[6 + next]});
  }
  return all;
}

/// Vertices of the divided icosahedron, from top to bottom.
std::vector<Vec3> geodesic(int frequency) {
  constexpr double kSame = 1e-6;
  std::vector<Vec3> found;
  for (const auto& [a, b, c] : faces())
    for (int i = 0; i <= frequency; ++i)
      for (int j = 0; i + j <= frequency; ++j) {
        const Vec3 p = normalized(a * i + b * j + c * (frequency - i - j));
        const bool known =
            std::ranges::any_of(found, [&](Vec3 q) { return length(p - q) < kSame; });
        if (!known) found.push_back(p);
      }
  std::ranges::stable_sort(found, [](Vec3 p, Vec3 q) { return p.y > q.y + kSame; });
  return found;
}

std::vector<Vec3> fibonacci(int count) {
  const double turn = pi * (3.0 - std::sqrt(5.0));
  std::vector<Vec3> directions;
  for (int n = 0; n < count; ++n) {
    const double y = 1.0 - (2.0 * n + 1.0) / count;
    const double ring = std::sqrt(1.0 - y * y);
    directions.push_back({ring * std::cos(turn * n), y, ring * std::sin(turn * n)});
  }
  return directions;
}

}  // namespace

std::vector<Vec3> light_sphere_directions(int count) {
  ENSURE(count >= 1);
  if (count != 156 && count != 346) return fibonacci(count);
  std::vector<Vec3> directions = geodesic(count == 156 ? 4 : 6);
  directions.resize(static_cast<std::size_t>(count));
  return directions;
}

std::vector<SphereLight> light_sphere(int count, double radius_mm, double intensity) {
  std::vector<SphereLight> lights;
  for (const Vec3 direction : light_sphere_directions(count))
    lights.push_back({direction * radius_mm, intensity});
  return lights;
}

}  // namespace opaline
