#pragma once

#include <cmath>

#include "render/mesh/triangle_mesh.h"

namespace opaline::render {

/// A solid as the signed distance to its surface, in mm: negative inside, 0 on the surface, positive outside.
///
/// Everything here asks for no more than this: at() never changes faster than the point moves (it is 1-Lipschitz), and its
/// sign is right. So a minimum of two distances, smaller than the true one inside, serves as well.
///
/// Threads: at() may be called from several threads.
class SignedDistance {
 public:
  virtual ~SignedDistance() = default;
  virtual double at(Vec3 point) const = 0;
  virtual Box bounds() const = 0;  ///< holds the whole solid

  /// The outward normal of the level surface through a point, by central differences over 2 `step`; zero where the
  /// distance has no gradient.
  Vec3 normal(Vec3 p, double step) const {
    const Vec3 g{at({p.x + step, p.y, p.z}) - at({p.x - step, p.y, p.z}),
                 at({p.x, p.y + step, p.z}) - at({p.x, p.y - step, p.z}),
                 at({p.x, p.y, p.z + step}) - at({p.x, p.y, p.z - step})};
    const double size = length(g);
    return size > 0.0 ? g * (1.0 / size) : Vec3{};
  }
};

}  // namespace opaline::render
