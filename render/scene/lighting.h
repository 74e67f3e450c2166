#pragma once

#include <limits>

#include "render/scene/scene.h"

namespace opaline::render {

/// What a light sends to a place.
struct LightSample {
  Vec3 towards;                                               ///< the light, of length 1
  double distance = std::numeric_limits<double>::infinity();  ///< mm
  Colour irradiance{};  ///< on a surface across the light, W/mm^2; black where it does not reach
};

/// Far away: the light's irradiance. Point: I / d^2. Spot: the same times a smoothstep of the angle from its axis, 1 within
/// cone - blur and 0 beyond the cone. Disc: as if all of it were in its middle, I cos a / d^2 with I = pi r^2 L.
LightSample sample(const LightOptions& light, Vec3 place);

/// A light that is as large as it is, as lights that are not: a disc as `samples` small ones that share its area, spread evenly
/// (equal areas, the golden angle); others as they are.
std::vector<LightOptions> parts_of(const LightOptions& light);

bool is_black(const Colour& colour);

/// The direction in which light from `towards` goes on behind a surface (Snell).
Vec3 refracted(Vec3 towards, Vec3 normal, double ior);

/// Directions over the half space around +z, as many as `count`, spread evenly (the golden angle about the axis) with the
/// density cos theta / pi: the mean of f over them is int f cos theta dw / pi.
std::vector<Vec3> cosine_directions(int count);

/// Two directions across `normal` and across each other (Duff et al., Building an orthonormal basis, revisited, 2017).
struct Frame {
  Vec3 x;
  Vec3 y;
  Vec3 z;
  Vec3 to_scene(Vec3 v) const { return x * v.x + y * v.y + z * v.z; }
};
Frame frame_around(Vec3 normal);

}  // namespace opaline::render
