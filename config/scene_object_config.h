#pragma once

#include "config/fields.h"
#include "render/scene/scene.h"

namespace opaline::config {

inline constexpr double kFarthest = 1e6;  ///< mm, of anything in a scene

/// Three coordinates.
void visit_vector(Fields& fields, const Key& key, Vec3& value, Unit unit);

/// One of a scene's objects: shape, surface, material, strokes, bending.
void visit_object(Fields& fields, render::ObjectOptions& object);

}  // namespace opaline::config
