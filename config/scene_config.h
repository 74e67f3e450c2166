#pragma once

#include <filesystem>
#include <string>

#include "base/result.h"
#include "config/toml.h"
#include "render/scene/scene.h"

namespace opaline::config {

/// Reads a scene file (docs/rendering.md).
/// Errors: kNotFound when it is missing; kInvalidArgument with every problem, one a line: FILE:LINE:COLUMN: what is wrong,
///         and what would be right.
Result<render::Scene> load_scene(const std::filesystem::path& file);
Result<render::Scene> parse_scene(const Source& source);

/// The explained file with every key and its default: config/scene.example.toml.
std::string scene_example();

}  // namespace opaline::config
