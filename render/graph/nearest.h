#pragma once

#include <span>
#include <vector>

#include "base/pose.h"
#include "render/solver/aggregation.h"

namespace opaline::render {

/// Values at places from those at the `count` nearest of other places, weighted by the inverse square of the distance
/// (Shepard 1968; Wang 2010, Eq. 10). Needs at least one place to take from.
Interpolation<float> nearest_interpolation(std::span<const Vec3> from,
                                           std::span<const Vec3> to,
                                           int count);

}  // namespace opaline::render
