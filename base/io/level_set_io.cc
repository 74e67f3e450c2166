#include "base/io/level_set_io.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <openvdb/io/Stream.h>
#include <openvdb/openvdb.h>
#include <openvdb/tools/VolumeToMesh.h>

#include <mutex>
#include <sstream>
#include <string>

#include "base/files.h"

namespace opaline {
namespace {

constexpr std::size_t kLargestFile = std::size_t{4} << 30;

void initialize_once() {
  static std::once_flag once;
  std::call_once(once, [] { openvdb::initialize(); });
}

Result<openvdb::FloatGrid::Ptr> find_level_set(const openvdb::GridPtrVec& grids) {
  std::vector<std::string> names;
  for (const auto& grid : grids) {
    const auto floats = openvdb::gridPtrCast<openvdb::FloatGrid>(grid);
    if (floats && grid->getGridClass() == openvdb::GRID_LEVEL_SET) return floats;
    names.push_back(fmt::format(
        "{} ({})", grid->getName(), openvdb::GridBase::gridClassToString(grid->getGridClass())));
  }
  return invalid_argument(fmt::format(
      "no level set in it, only {}; expected a float grid of class \"level set\", as Houdini's and "
      "Blender's mesh-to-volume nodes write signed distances",
      names.empty() ? "nothing" : fmt::format("{}", fmt::join(names, ", "))));
}

LevelSetSurface surface_of(const openvdb::FloatGrid& grid) {
  std::vector<openvdb::Vec3s> points;
  std::vector<openvdb::Vec3I> triangles;
  std::vector<openvdb::Vec4I> quads;
  openvdb::tools::volumeToMesh(grid, points, triangles, quads, 0.0, 0.0);
  LevelSetSurface surface;
  for (const auto& p : points) surface.vertices.push_back({p.x(), p.y(), p.z()});
  const auto add = [&](unsigned a, unsigned b, unsigned c) {  // OpenVDB's run clockwise
    surface.triangles.push_back({static_cast<int>(a), static_cast<int>(c), static_cast<int>(b)});
  };
  for (const auto& t : triangles) add(t[0], t[1], t[2]);
  for (const auto& q : quads) {
    add(q[0], q[1], q[2]);
    add(q[0], q[2], q[3]);
  }
  return surface;
}

Result<LevelSetSurface> decode(const std::string& bytes) {
  std::istringstream stream(bytes, std::ios::binary);
  openvdb::io::Stream archive(stream, /*delayLoad=*/false);
  const auto grid = find_level_set(*archive.getGrids());
  if (!grid) return grid.error();
  LevelSetSurface surface = surface_of(**grid);
  if (surface.triangles.empty()) {
    return invalid_argument(
        fmt::format("the surface of level set \"{}\" is empty", (*grid)->getName()));
  }
  return surface;
}

}  // namespace

Result<LevelSetSurface> read_level_set(const std::filesystem::path& path) {
  const auto bytes = read_text(path, kLargestFile);
  if (!bytes) return bytes.error();
  try {
    initialize_once();
    auto surface = decode(*bytes);
    if (!surface) return surface.error().in(path.string());
    return surface;
  } catch (const std::exception& error) {
    return invalid_argument(
        fmt::format("{}: no OpenVDB file, truncated or damaged ({})", path.string(), error.what()));
  }
}

}  // namespace opaline
