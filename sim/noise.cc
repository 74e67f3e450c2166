#include "sim/noise.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace opaline::sim {
namespace {

std::uint64_t mix(std::uint64_t z) {  // the finaliser of SplitMix64
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9U;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebU;
  return z ^ (z >> 31);
}

std::uint64_t lattice_hash(int x, int y, int z, std::uint64_t seed) {
  std::uint64_t h = mix(seed + 0x9e3779b97f4a7c15U);
  for (const int i : {x, y, z}) h = mix(h ^ (static_cast<std::uint32_t>(i) + 0x9e3779b97f4a7c15U));
  return h;
}

double unit(std::uint64_t bits) { return static_cast<double>(bits >> 11) * 0x1p-53; }

double fade(double t) { return t * t * t * (t * (t * 6.0 - 15.0) + 10.0); }

double corner(int x, int y, int z, Vec3 from_corner, std::uint64_t seed) {
  // One of the twelve edge directions of a cube, as in Perlin 2002.
  const std::uint64_t h = lattice_hash(x, y, z, seed) % 12;
  const double a = h % 2 == 0 ? 1.0 : -1.0;
  const double b = h / 2 % 2 == 0 ? 1.0 : -1.0;
  switch (h / 4) {
    case 0:
      return a * from_corner.x + b * from_corner.y;
    case 1:
      return a * from_corner.y + b * from_corner.z;
    default:
      return a * from_corner.z + b * from_corner.x;
  }
}

}  // namespace

double gradient_noise(Vec3 point, std::uint64_t seed) {
  const int x = static_cast<int>(std::floor(point.x));
  const int y = static_cast<int>(std::floor(point.y));
  const int z = static_cast<int>(std::floor(point.z));
  const Vec3 f{point.x - x, point.y - y, point.z - z};
  const Vec3 blend{fade(f.x), fade(f.y), fade(f.z)};
  double sum = 0.0;
  for (int i = 0; i < 8; ++i) {
    const int dx = i & 1;
    const int dy = i >> 1 & 1;
    const int dz = i >> 2;
    const double weight = (dx ? blend.x : 1.0 - blend.x) * (dy ? blend.y : 1.0 - blend.y) *
                          (dz ? blend.z : 1.0 - blend.z);
    sum += weight * corner(x + dx, y + dy, z + dz, {f.x - dx, f.y - dy, f.z - dz}, seed);
  }
  return sum;
}

double fractal_noise(Vec3 point, std::uint64_t seed, int octaves) {
  double sum = 0.0;
  double strength = 1.0;
  double total = 0.0;
  for (int i = 0; i < octaves; ++i) {
    sum += strength * gradient_noise(point, seed + i);
    total += strength;
    strength *= 0.5;
    point = point * 2.0;
  }
  return sum / total;
}

CellNoise cell_noise(Vec3 point, std::uint64_t seed) {
  const int x = static_cast<int>(std::floor(point.x));
  const int y = static_cast<int>(std::floor(point.y));
  const int z = static_cast<int>(std::floor(point.z));
  CellNoise noise{std::numeric_limits<double>::max(), std::numeric_limits<double>::max(), 0.0};
  for (int i = 0; i < 27; ++i) {
    const int cx = x + i % 3 - 1;
    const int cy = y + i / 3 % 3 - 1;
    const int cz = z + i / 9 - 1;
    const std::uint64_t h = lattice_hash(cx, cy, cz, seed);
    const Vec3 centre{cx + unit(h), cy + unit(mix(h + 1)), cz + unit(mix(h + 2))};
    const double distance = length(point - centre);
    if (distance < noise.nearest) {
      noise.second = noise.nearest;
      noise.nearest = distance;
      noise.value = unit(mix(h + 3));
    } else {
      noise.second = std::min(noise.second, distance);
    }
  }
  return noise;
}

}  // namespace opaline::sim
