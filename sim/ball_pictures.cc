#include "sim/ball_pictures.h"

#include <cmath>
#include <random>

namespace opaline::sim {
namespace {

constexpr double kSeenSquared = 0.6;  // of the radius, squared

}  // namespace

double BallScene::decay() const { return std::sqrt(3.0 * (1.0 - reduced_albedo)); }
double BallScene::diffusion() const { return decay() * translucency_mm / 3.0; }
Ball BallScene::ball() const {
  return {reduced_albedo, radius_mm / (decay() * translucency_mm), ior};
}

BallPictures draw_ball(const BallScene& scene, const BallLight& light) {
  BallPictures p;
  p.width = p.height = static_cast<int>(1.6 * scene.radius_mm / scene.pixel_mm);
  const std::size_t count = static_cast<std::size_t>(p.width) * static_cast<std::size_t>(p.height);
  for (auto* all : {&p.radiance, &p.variance})
    for (auto& picture : *all) picture.assign(count, 0.0F);
  p.measured.assign(count, 0);
  p.normal_x.assign(count, 0.0F);
  p.normal_y.assign(count, 0.0F);
  std::mt19937_64 random(scene.seed);
  std::normal_distribution<double> gaussian(0.0, 1.0);
  const double bulge = scene.dent ? -1.0 : 1.0;
  const double constant = scene.white * light.reflectance;
  for (std::size_t at = 0; at < count; ++at) {
    const auto x = static_cast<double>(at % static_cast<std::size_t>(p.width));
    const std::size_t row = at / static_cast<std::size_t>(p.width);
    const auto y = static_cast<double>(row);
    const double nx = bulge * (x - 0.5 * p.width) * scene.pixel_mm / scene.radius_mm;
    const double ny = bulge * (y - 0.5 * p.height) * scene.pixel_mm / scene.radius_mm;
    const double across = nx * nx + ny * ny;
    if (across > kSeenSquared) continue;
    p.measured[at] = 1;
    p.normal_x[at] = static_cast<float>(nx);
    p.normal_y[at] = static_cast<float>(ny);
    const double sine = std::sqrt(across);
    const double tilted = std::asin(sine) + light.tilt * sine;
    const double aside = sine > 0.0 ? std::sin(tilted) / sine : 0.0;
    const std::array<double, 3> normal{nx * aside, ny * aside, std::cos(tilted)};
    for (std::size_t n = 0; n < 4; ++n) {
      const double clean = n == 0 ? constant : 0.5 * constant * (1.0 + normal[n - 1] / light.ratio);
      const double deviation = scene.noise * clean + 1e-9;
      p.radiance[n][at] = static_cast<float>(clean + deviation * gaussian(random));
      p.variance[n][at] = static_cast<float>(deviation * deviation);
    }
  }
  return p;
}

}  // namespace opaline::sim
