#include "render/scene/noise.h"

#include <array>
#include <cmath>
#include <cstdint>

namespace opaline::render {
namespace {

std::uint32_t hash(std::int64_t x, std::int64_t y, std::int64_t z) {
  auto h = static_cast<std::uint32_t>(x) * 0x8da6b343U ^
           static_cast<std::uint32_t>(y) * 0xd8163841U ^
           static_cast<std::uint32_t>(z) * 0xcb1ab31fU;
  h = (h ^ h >> 15) * 0x2c1b3c6dU;
  h = (h ^ h >> 12) * 0x297a2d39U;
  return h ^ h >> 15;
}

double gradient(std::int64_t x, std::int64_t y, std::int64_t z, Vec3 from) {
  static constexpr std::array<Vec3, 12> kGradients{{{1, 1, 0},
                                                    {-1, 1, 0},
                                                    {1, -1, 0},
                                                    {-1, -1, 0},
                                                    {1, 0, 1},
                                                    {-1, 0, 1},
                                                    {1, 0, -1},
                                                    {-1, 0, -1},
                                                    {0, 1, 1},
                                                    {0, -1, 1},
                                                    {0, 1, -1},
                                                    {0, -1, -1}}};
  return dot(kGradients[hash(x, y, z) % kGradients.size()], from);
}

double fade(double t) { return t * t * t * (t * (t * 6.0 - 15.0) + 10.0); }

double mix(double a, double b, double t) { return a + t * (b - a); }

}  // namespace

double gradient_noise(Vec3 place) {
  const auto x = static_cast<std::int64_t>(std::floor(place.x));
  const auto y = static_cast<std::int64_t>(std::floor(place.y));
  const auto z = static_cast<std::int64_t>(std::floor(place.z));
  const Vec3 f{
      place.x - std::floor(place.x), place.y - std::floor(place.y), place.z - std::floor(place.z)};
  std::array<double, 8> corners{};
  for (int k = 0; k < 8; ++k) {
    const int i = k & 1;
    const int j = k >> 1 & 1;
    const int l = k >> 2;
    corners[k] = gradient(x + i, y + j, z + l, f - Vec3{double(i), double(j), double(l)});
  }
  const double u = fade(f.x);
  const double v = fade(f.y);
  const double low = mix(mix(corners[0], corners[1], u), mix(corners[2], corners[3], u), v);
  const double high = mix(mix(corners[4], corners[5], u), mix(corners[6], corners[7], u), v);
  return mix(low, high, fade(f.z));
}

double fractal_noise(Vec3 place, int octaves) {
  double sum = 0.0;
  double size = 1.0;
  for (int octave = 0; octave < octaves; ++octave, size *= 0.5) {
    sum += size * gradient_noise(place * (1.0 / size) + Vec3{17.0 * octave, 5.0, 3.0});
  }
  return sum;
}

}  // namespace opaline::render
