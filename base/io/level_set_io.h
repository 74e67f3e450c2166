#pragma once

#include <array>
#include <filesystem>
#include <vector>

#include "base/pose.h"
#include "base/result.h"

namespace opaline {

/// The surface of a level set, as triangles that run counter-clockwise seen from outside; lengths in the file's unit.
struct LevelSetSurface {
  std::vector<Vec3> vertices;
  std::vector<std::array<int, 3>> triangles;
};

/// Reads the zero surface of the first level set in an OpenVDB file (a float grid of class "level set": negative inside),
/// by dual contouring, one vertex a voxel that the surface cuts.
///
/// Errors: kNotFound; kInvalidArgument for a file that is truncated, damaged or no VDB, that has no level set (its grids are
///         named), or one whose surface is empty.
Result<LevelSetSurface> read_level_set(const std::filesystem::path& path);

}  // namespace opaline
