#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "render/scene/scene_renderer.h"

namespace opaline::daemon {

/// What rendering took, for programs:
///
///   objects[]   name, kind, triangles; of a translucent one tetrahedra, unknowns, spacing_mm, volume_mm3,
///               smallest_dihedral_degrees, components, iterations, relative_residual, and how its diffuse light went in:
///               environment_entry and lamps_entry, "dark", "at the surface", "followed", "followed before"
///   seconds     load, mesh, setup, and of the last picture light, solve, draw
///   left_out[]  what the scene cannot show, and why;   notes[]  what a user should know
nlohmann::json to_json(const render::SceneStatistics& statistics);

/// The same for people, a few lines.
std::string to_text(const render::SceneStatistics& statistics);

}  // namespace opaline::daemon
