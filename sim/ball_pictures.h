#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "sim/ball_transport.h"

namespace opaline::sim {

/// A ball among lights, seen along z by an orthographic camera.
struct BallScene {
  double reduced_albedo = 0.95;
  double translucency_mm = 1.5;  ///< l_d = 1/sigma_tr
  double radius_mm = 10.0;
  double ior = 1.4;
  double pixel_mm = 0.1;
  double white = 1000.0;   ///< what a surface that gives back all of the light reads
  double noise = 0.0;      ///< relative, Gaussian
  bool dent = false;       ///< the ball's normals turned inside out
  std::uint64_t seed = 1;  ///< of the noise

  double decay() const;      ///< g = sqrt(3 (1 - alpha'))
  double diffusion() const;  ///< D = g l_d / 3, mm
  Ball ball() const;         ///< the same in mean free paths
};

/// Cross-polarised pictures under constant light and under (1 + omega_x)/2, (1 + omega_y)/2, (1 + omega_z)/2. A pixel's radiance is taken to be as
/// its exitance, its gradients' vector tilted (BallLight).
struct BallPictures {
  int width = 0;
  int height = 0;
  std::array<std::vector<float>, 4> radiance;
  std::array<std::vector<float>, 4> variance;
  std::vector<std::uint8_t> measured;     ///< within 0.77 of the radius
  std::vector<float> normal_x, normal_y;  ///< the truth
};

BallPictures draw_ball(const BallScene& scene, const BallLight& light);

}  // namespace opaline::sim
