#include "reconstruct/spherical_gradient/normal_softness.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "reconstruct/diffusion/fresnel.h"
#include "reconstruct/spherical_gradient/curvature_blocks.h"

namespace opaline::reconstruct {
namespace {

constexpr double kMostTurn = 0.2;  // radians

double dipole_spread(double translucency, double diffusion, double boundary) {
  double weights = 0.0;
  double depths = 0.0;
  for (const double depth : {3.0 * diffusion, diffusion * (3.0 + 4.0 * boundary)}) {
    const double weight = std::exp(-depth / translucency);
    weights += weight;
    depths += weight * depth;
  }
  return translucency * depths / weights;
}

double boundary_of(double ior) {
  const double inside = diffusion::internal_moments(ior).fluence;
  return (1.0 + inside) / (1.0 - inside);
}

double length_of(const std::array<double, 3>& v) {
  return std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
}

void turn_normal(double by_x, double by_y, std::size_t at, ScatteringMaps& maps) {
  const std::array<double, 3> n{maps.normal_x[at], maps.normal_y[at], maps.normal_z[at]};
  const double along = by_x * n[0] + by_y * n[1];
  std::array<double, 3> turn{by_x - along * n[0], by_y - along * n[1], -along * n[2]};
  const double size = length_of(turn);
  const double kept = size > kMostTurn ? kMostTurn / size : 1.0;
  std::array<double, 3> sharp{};
  for (std::size_t k = 0; k < 3; ++k) sharp[k] = n[k] - kept * turn[k];
  const double length = length_of(sharp);
  if (!(length > 0.0)) return;
  maps.normal_x[at] = static_cast<float>(sharp[0] / length);
  maps.normal_y[at] = static_cast<float>(sharp[1] / length);
  maps.normal_z[at] = static_cast<float>(sharp[2] / length);
}

}  // namespace

double spread_along_axis(double translucency, double diffusion, double ior) {
  return dipole_spread(translucency, diffusion, boundary_of(ior));
}

void sharpen_normals(const GradientPictures& pictures,
                     double ior,
                     ThreadTeam& team,
                     ScatteringMaps& maps) {
  const double boundary = boundary_of(ior);
  const double translucency = quantile_of_answers(maps, maps.translucency, 0.5);
  if (!(translucency > 0.0)) return;
  const double usual =
      dipole_spread(translucency, quantile_of_answers(maps, maps.diffusion, 0.5), boundary);
  const double pixel = pictures.pixel_mm;
  const CurvatureBlocks blocks(maps, CurvatureBlocks::side_for(std::sqrt(usual) / pixel), team);
  team.run([&](int thread) {
    CurvatureBlocks::Walker walker(blocks);
    double spread = usual;
    double spread_of = translucency;  // l_d
    for (int y = thread; y < maps.height; y += team.size())
      for (int x = 0; x < maps.width; ++x) {
        const std::size_t at = static_cast<std::size_t>(y) * static_cast<std::size_t>(maps.width) +
                               static_cast<std::size_t>(x);
        if (maps.curvature[at] == 0.0F) continue;
        const double here =
            maps.left_out[at] == LeftOut::kFound ? maps.translucency[at] : translucency;
        if (here != spread_of) {
          spread = maps.left_out[at] == LeftOut::kFound
                       ? dipole_spread(here, maps.diffusion[at], boundary)
                       : usual;
          spread_of = here;
        }
        const auto& around = walker.around(x, y, std::sqrt(spread) / pixel);
        turn_normal(spread * around.by_x / pixel, spread * around.by_y / pixel, at, maps);
      }
  });
}

}  // namespace opaline::reconstruct
