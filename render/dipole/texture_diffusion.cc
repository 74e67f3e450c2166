#include "render/dipole/texture_diffusion.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "reconstruct/diffusion/fresnel.h"

namespace opaline::render {
namespace {

using std::numbers::pi;

constexpr double kDipoleReach = 8.0;  // l_d
constexpr int kMostTexels = 200;      // of a kernel's reach

struct DipoleKernel {
  double albedo = 0.0;
  double real = 1.0;
  double image = 1.0;
  double sigma = 1.0;

  DipoleKernel(double reduced_albedo, double diffusion, double a)
      : albedo(reduced_albedo),
        real(3.0 * diffusion),
        image(diffusion * (3.0 + 4.0 * a)),
        sigma(std::sqrt(3.0 * std::max(1e-6, 1.0 - reduced_albedo)) / (3.0 * diffusion)) {}
  double at(double square) const {
    return albedo / (4.0 * pi) * (part(square, real) + part(square, image));
  }
  /// int_0^a R_d 2 pi s ds
  double disc(double radius) const {
    return 0.5 * albedo * (inside(radius, real) + inside(radius, image));
  }

 private:
  double part(double square, double z) const {
    const double d = std::sqrt(square + z * z);
    return z * (1.0 + sigma * d) * std::exp(-sigma * d) / (d * d * d);
  }
  double inside(double radius, double z) const {
    const double d = std::hypot(radius, z);
    return std::exp(-sigma * z) - z / d * std::exp(-sigma * d);
  }
};

/// int Ft mu dmu and int Ft mu^2 dmu from outside, by the midpoint rule.
std::array<double, 2> entry_moments(double ior) {
  constexpr int kSteps = 2000;
  std::array<double, 2> moments{};
  for (int n = 0; n < kSteps; ++n) {
    const double mu = (n + 0.5) / kSteps;
    const double through = (1.0 - reconstruct::diffusion::fresnel_reflectance(mu, ior)) / kSteps;
    moments[0] += through * mu;
    moments[1] += through * mu * mu;
  }
  return moments;
}

bool fits(const TexelSurface& s) {
  const auto count = static_cast<std::size_t>(std::max(0, s.width)) *
                     static_cast<std::size_t>(std::max(0, s.height));
  return count > 0 && s.texel_mm > 0.0 && s.position.size() == count && s.normal.size() == count &&
         s.area.size() == count && s.covered.size() == count && s.reduced_albedo.size() == count &&
         s.diffusion.size() == count;
}

double gathered(const TexelSurface& s, const std::vector<float>& power, int x, int y, double a) {
  const std::size_t at =
      static_cast<std::size_t>(y) * static_cast<std::size_t>(s.width) + static_cast<std::size_t>(x);
  const DipoleKernel kernel(s.reduced_albedo[at], s.diffusion[at], a);
  const double reach = kDipoleReach / kernel.sigma;
  const int half = static_cast<int>(std::min(1.0 * kMostTexels, reach / s.texel_mm)) + 1;
  double sum = power[at] / s.area[at] * kernel.disc(std::sqrt(s.area[at] / pi));
  for (int j = std::max(0, y - half); j <= std::min(s.height - 1, y + half); ++j)
    for (int i = std::max(0, x - half); i <= std::min(s.width - 1, x + half); ++i) {
      const std::size_t from = static_cast<std::size_t>(j) * static_cast<std::size_t>(s.width) +
                               static_cast<std::size_t>(i);
      if (from == at || s.covered[from] == 0) continue;
      const Vec3 to = s.position[from] - s.position[at];
      const double square = dot(to, to);
      if (square < reach * reach) sum += power[from] * kernel.at(square);
    }
  return sum;
}

}  // namespace

Result<std::vector<float>> diffuse_texels(const TexelSurface& s,
                                          const LinearLight& light,
                                          double ior,
                                          ThreadTeam& team) {
  if (!fits(s))
    return invalid_argument("texels: positions, normals, areas and maps of different sizes");
  if (!(ior >= 1.0 && ior <= 3.0)) return invalid_argument("texels: an index outside 1 to 3");
  const auto [first, second] = entry_moments(ior);
  const double inside = reconstruct::diffusion::internal_moments(ior).fluence;
  const double a = (1.0 + inside) / (1.0 - inside);
  std::vector<float> power(s.covered.size(), 0.0F);
  for (std::size_t at = 0; at < power.size(); ++at) {
    if (s.covered[at] == 0) continue;
    if (!(s.diffusion[at] > 0.0F && s.area[at] > 0.0F))
      return invalid_argument("texels: a covered one without area or diffusion");
    const double q =
        2.0 * pi * (light.constant * first + dot(light.gradient, s.normal[at]) * second);
    power[at] = static_cast<float>(std::max(0.0, q) * s.area[at]);
  }
  std::vector<float> exitance(power.size(), 0.0F);
  team.run([&](int thread) {
    for (int y = thread; y < s.height; y += team.size())
      for (int x = 0; x < s.width; ++x) {
        const std::size_t at = static_cast<std::size_t>(y) * static_cast<std::size_t>(s.width) +
                               static_cast<std::size_t>(x);
        if (s.covered[at] != 0) exitance[at] = static_cast<float>(gathered(s, power, x, y, a));
      }
  });
  return exitance;
}

}  // namespace opaline::render
