#pragma once

#include <functional>

#include "base/material.h"
#include "render/graph/optics.h"
#include "render/mesh/triangle_mesh.h"

namespace opaline::render {

/// A block that covers `bounds`, its cells cubes of `cell_mm`, with the coefficients that `at` has in their centres; its
/// corner is `bounds.low`. Errors: kInvalidArgument for more than 2^27 cells.
Result<Material> sampled_block(const Box& bounds,
                               double cell_mm,
                               double ior,
                               const std::function<Optics(Vec3)>& at);

}  // namespace opaline::render
