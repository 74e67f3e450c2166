#pragma once

#include <cstdint>

#include "base/pose.h"

namespace opaline::sim {

/// Gradient noise (Perlin 2002, "Improving Noise": quintic fade) on a unit lattice, with hashed
/// gradients from a seed. Smooth, zero on lattice points, about -1 to 1, no period within 2^31.
double gradient_noise(Vec3 point, std::uint64_t seed);

/// `octaves` of it, each half as large and half as strong, scaled to about -1 to 1.
double fractal_noise(Vec3 point, std::uint64_t seed, int octaves);

/// The nearest two of the points scattered one a lattice cell (Worley 1996).
struct CellNoise {
  double nearest = 0.0;  ///< distance to the nearest point
  double second = 0.0;   ///< distance to the next
  double value = 0.0;    ///< of the nearest point's cell, 0 to 1
};
CellNoise cell_noise(Vec3 point, std::uint64_t seed);

}  // namespace opaline::sim
