#pragma once

#include "base/pose.h"

namespace opaline::render {

/// Smooth noise of three coordinates, about -1 to 1, 0 on whole ones: gradients at the corners of the unit lattice, chosen
/// by a hash, blended with 6 t^5 - 15 t^4 + 10 t^3 (Perlin, Improving noise, SIGGRAPH 2002).
double gradient_noise(Vec3 place);

/// Sum of octaves of it, each of twice the frequency and half the size.
double fractal_noise(Vec3 place, int octaves);

}  // namespace opaline::render
