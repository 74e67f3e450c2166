#pragma once

#include <vector>

#include "base/pose.h"

namespace opaline {

/// A lamp on a sphere of lights. The sphere's frame: origin in the middle, mm, y up.
struct SphereLight {
  Vec3 position;
  double intensity = 1.0;  ///< towards the middle at full code, W/sr, white: each colour channel's
  bool operator==(const SphereLight&) const = default;
};

/// Near-uniform unit vectors, as such spheres are built:
///
///   156  the vertices of an icosahedron whose edges are divided by 4 (10 4^2 + 2 = 162), one of them at the bottom, less that one and the
///        5 around it, where the stand is
///   346  the same divided by 6 (10 6^2 + 2 = 362), less the lowest 16
///   any other count: equal steps in height and golden-angle turns (a Fibonacci lattice), from top to bottom
///
/// ENSUREs count >= 1.
std::vector<Vec3> light_sphere_directions(int count);

/// `count` equal lamps on a sphere.
std::vector<SphereLight> light_sphere(int count, double radius_mm, double intensity);

}  // namespace opaline
