#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "base/thread_team.h"

namespace opaline::reconstruct {

/// What every pixel of an orthographic picture says by itself: the normal across the line of sight, the ratio r and the reflectance.
struct PixelValues {
  int width = 0;
  int height = 0;
  std::vector<float> normal_x;
  std::vector<float> normal_y;
  std::vector<float> normal_variance;  ///< of n_x and n_y, on average
  std::vector<float> ratio;
  std::vector<float> ratio_variance;
  std::vector<float> reflectance;
  std::vector<float> reflectance_variance;
  std::vector<std::uint8_t> measured;  ///< the others are left out of every sum

  PixelValues(int w, int h, ThreadTeam& team);
  std::size_t index(int x, int y) const { return static_cast<std::size_t>(y) * width + x; }
};

/// The same in a square window around a pixel, each a mean of its n pixels but the curvature: the normals' divergence, from planes fitted
/// to n_x and n_y,
///
///   2 H = d n_x/dx + d n_y/dy      (for a graph z(x, y) with n = (-z_x, -z_y, 1)/W, exactly; 1/R on a ball)
///
/// so a ball's curvature is found without bias in windows of any size.
struct WindowValues {
  int count = 0;           ///< measured pixels; nothing else is set below six of them
  float curvature = 0.0F;  ///< H, 1/pixel
  float curvature_variance = 0.0F;
  /// ((k_1 - k_2)/2)^2 = H^2 - K of the principal curvatures, 1/pixel^2, less what noise adds to it; below 0 by noise. K is the determinant of the planes' slopes.
  float unevenness = 0.0F;
  float normal_x = 0.0F;  ///< of those planes at the pixel itself
  float normal_y = 0.0F;
  float normal_variance = 0.0F;  ///< of one component
  float ratio = 0.0F;
  float ratio_variance = 0.0F;
  float reflectance = 0.0F;
  float reflectance_variance = 0.0F;
};

/// Calls f(x, y, window) for the measured pixels, from several threads; `half` pixels on either side, clipped at the picture's edge. Sums slide, so the time
/// does not depend on the window. From half = 8 on, pixels go by cells of half/4 (a power of two): those of a cell share their window, of whole cells, and differ
/// in their place on its planes (window_rows.h).
void for_each_window(const PixelValues& pixels,
                     int half,
                     ThreadTeam& team,
                     const std::function<void(int x, int y, const WindowValues& window)>& f);

}  // namespace opaline::reconstruct
