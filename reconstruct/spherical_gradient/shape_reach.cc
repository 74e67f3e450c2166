#include "reconstruct/spherical_gradient/shape_reach.h"

#include <algorithm>
#include <cmath>

#include "reconstruct/spherical_gradient/curvature_blocks.h"

namespace opaline::reconstruct {
namespace {

constexpr double kInterreflectionReach = 2.0;  // l_d
constexpr double kBendReach = 0.7;             // l_d: most of the light comes from within
constexpr double kMostDeviation = 0.5;         // of ln D: more is no answer
constexpr double kLeastShare = 0.05;           // of the pixels that blocks may be too large for

void leave_out(std::size_t at, LeftOut reason, ScatteringMaps& maps) {
  maps.left_out[at] = reason;
  for (auto* map : {&maps.reduced_albedo,
                    &maps.diffusion,
                    &maps.translucency,
                    &maps.reduced_scattering,
                    &maps.absorption,
                    &maps.log_diffusion_deviation,
                    &maps.albedo_deviation})
    (*map)[at] = 0.0F;
}

}  // namespace

void account_for_shape(const GradientPictures& pictures, ThreadTeam& team, ScatteringMaps& maps) {
  const double least = quantile_of_answers(maps, maps.translucency, kLeastShare);
  const CurvatureBlocks blocks(
      maps, CurvatureBlocks::side_for(kBendReach * least / pictures.pixel_mm), team);
  team.run([&](int thread) {
    CurvatureBlocks::Walker far(blocks);
    CurvatureBlocks::Walker near_by(blocks);
    for (int y = thread; y < maps.height; y += team.size())
      for (int x = 0; x < maps.width; ++x) {
        const std::size_t at = static_cast<std::size_t>(y) * static_cast<std::size_t>(maps.width) +
                               static_cast<std::size_t>(x);
        if (maps.left_out[at] != LeftOut::kFound) continue;
        const double reach = maps.translucency[at] / pictures.pixel_mm;
        if (far.around(x, y, kInterreflectionReach * reach).concave > 0.0) {
          leave_out(at, LeftOut::kInterreflection, maps);
          continue;
        }
        const auto& near = near_by.around(x, y, kBendReach * reach);
        const double h = maps.curvature[at];
        const double off = near.mean - h;
        const double spread = (near.variance + off * off) / (h * h);
        const double stated = maps.log_diffusion_deviation[at];
        const double beyond_noise = std::max(0.0, spread - 2.0 * stated * stated);
        const double deviation = std::sqrt(stated * stated + beyond_noise);
        if (deviation > kMostDeviation) {
          leave_out(at, LeftOut::kUneven, maps);
        } else {
          maps.log_diffusion_deviation[at] = static_cast<float>(deviation);
        }
      }
  });
}

}  // namespace opaline::reconstruct
