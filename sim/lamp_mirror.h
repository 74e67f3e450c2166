#pragma once

#include <span>
#include <vector>

#include "base/light_sphere.h"

namespace opaline::sim {

/// A rough dielectric surface where a camera sees it.
struct MirrorSurface {
  Vec3 point;
  Vec3 normal;
  Vec3 to_camera;
  double ior = 1.4;
  double roughness = 0.15;  ///< GGX alpha
};

/// Radiance that lamps of `power` (W/sr) have by reflection at the surface, after Cook and Torrance: GGX's distribution of normals, Smith's shadowing,
/// Fresnel. Nothing hides a lamp but the surface's own plane.
double mirrored_lamps(std::span<const SphereLight> lamps,
                      const std::vector<double>& power,
                      const MirrorSurface& surface);

}  // namespace opaline::sim
