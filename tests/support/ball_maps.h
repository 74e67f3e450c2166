#pragma once

#include <cmath>

#include "daemon/scattering/sphere_maps.h"
#include "daemon/scattering/sphere_session.h"

namespace opaline::support {

inline constexpr int kPixels = 96;
inline constexpr double kPixelMm = 0.2;
inline constexpr double kRadius = 8.0;
inline constexpr double kSeen = 0.9;  // of the radius

/// Maps of a ball of 8 mm: D 0.2 mm, l_d 1.5 mm everywhere; the left half without an answer where `holes`.
inline daemon::SphereMaps ball_maps(bool holes) {
  daemon::SphereMaps maps;
  for (auto& m : maps.channels) {
    m.width = m.height = kPixels;
    const std::size_t count = std::size_t{kPixels} * kPixels;
    for (auto* values : {&m.normal_x,
                         &m.normal_y,
                         &m.normal_z,
                         &m.curvature,
                         &m.reduced_albedo,
                         &m.albedo_deviation,
                         &m.diffusion,
                         &m.log_diffusion_deviation,
                         &m.translucency,
                         &m.reduced_scattering,
                         &m.absorption})
      values->assign(count, 0.0F);
    m.left_out.assign(count, reconstruct::LeftOut::kNotMeasured);
    for (int y = 0; y < kPixels; ++y)
      for (int x = 0; x < kPixels; ++x) {
        const double nx = (x + 0.5 - 0.5 * kPixels) * kPixelMm / kRadius;
        const double ny = (y + 0.5 - 0.5 * kPixels) * kPixelMm / kRadius;
        if (std::hypot(nx, ny) > kSeen) continue;
        const auto at = static_cast<std::size_t>(y * kPixels + x);
        m.normal_x[at] = static_cast<float>(nx);
        m.normal_y[at] = static_cast<float>(ny);
        m.normal_z[at] = static_cast<float>(std::sqrt(1.0 - nx * nx - ny * ny));
        if (holes && x < kPixels / 2) {
          m.left_out[at] = reconstruct::LeftOut::kTooFlat;
          continue;
        }
        m.left_out[at] = reconstruct::LeftOut::kFound;
        m.reduced_albedo[at] = 0.95F;
        m.diffusion[at] = 0.2F;
        m.translucency[at] = 1.5F;
        m.reduced_scattering[at] = 1.6F;
        m.absorption[at] = 0.08F;
      }
  }
  return maps;
}

inline daemon::SphereSession ball_session(const daemon::SphereMaps& maps) {
  daemon::SphereSession session;
  session.record.pixel_mm = kPixelMm;
  session.measured = Image<std::uint8_t>(kPixels, kPixels, 1);
  for (std::size_t at = 0; at < maps.channels[0].normal_z.size(); ++at)
    session.measured.samples()[at] = maps.channels[0].normal_z[at] > 0.0F ? 1 : 0;
  return session;
}

}  // namespace opaline::support
