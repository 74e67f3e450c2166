#include "render/scene/solid.h"

#include <fmt/format.h>

#include <algorithm>

#include "base/io/level_set_io.h"
#include "render/mesh/mesh_distance.h"
#include "render/mesh/overlap.h"
#include "render/mesh/read_mesh.h"
#include "render/mesh/shapes.h"
#include "render/mesh/turn.h"
#include "render/tetrahedra/read_tets.h"
#include "render/tetrahedra/stuffing.h"

namespace opaline::render {
namespace {

constexpr int kPlaneCells = 128;

double longest(Vec3 size) { return std::max({size.x, size.y, size.z}); }

Result<TriangleMesh> read_surface(const std::filesystem::path& file, const std::stop_token& stop) {
  if (file.extension() != ".vdb" && file.extension() != ".VDB") {
    return read_mesh(file, 1.0, stop);
  }
  auto surface = read_level_set(file);
  if (!surface) return surface.error();
  return TriangleMesh{std::move(surface->vertices), std::move(surface->triangles)};
}

/// Moves a file's vertices to where the shape stands.
Result<void> place(std::vector<Vec3>& vertices, const ShapeOptions& shape) {
  const Box box = bounds({vertices, {}});
  const double extent = longest(box.size());
  if (!(extent > 0.0)) {
    return invalid_argument("all of its corners are one").in(shape.file.string());
  }
  const double scale = shape.size_mm > 0.0 ? shape.size_mm / extent : shape.unit_mm;
  const Vec3 origin = shape.centred ? box.centre() : Vec3{};
  const Pose pose = scene_from_shape(shape);
  for (Vec3& p : vertices) p = pose.apply((p - origin) * scale);
  return ok();
}

/// The file's triangles, or the surface of its tetrahedra, which `tets` gets.
Result<TriangleMesh> placed_surface(const ShapeOptions& shape,
                                    std::optional<TetMesh>& tets,
                                    const std::stop_token& stop) {
  if (is_tet_file(shape.file)) {
    auto read = read_tets(shape.file);
    if (!read) return read.error();
    if (auto placed = place(read->vertices, shape); !placed) return placed.error();
    tets = *std::move(read);
    return surface_mesh(*tets);
  }
  auto mesh = read_surface(shape.file, stop);
  if (!mesh) return mesh.error();
  if (auto placed = place(mesh->vertices, shape); !placed) return placed.error();
  return mesh;
}

std::vector<std::string> notes_on(const TriangleMesh& mesh,
                                  const MeshDistance& distance,
                                  const std::filesystem::path& file,
                                  const std::stop_token& stop) {
  const MeshTopology found = topology(weld(mesh, stop), stop);
  std::vector<std::string> notes;
  const auto say = [&](const std::string& what) {
    notes.push_back(fmt::format("{}: {}", file.filename().string(), what));
  };
  if (found.open_edges > 0) {
    say(fmt::format("not closed ({} open edges): its holes are closed as a soap film would",
                    found.open_edges));
  }
  if (found.crowded_edges > 0) {
    say(fmt::format("{} edges have more than two triangles: what overlaps is joined",
                    found.crowded_edges));
  }
  if (found.flipped_edges > 0) {
    say(
        fmt::format("neighbouring triangles face different ways at {} edges: what they enclose may "
                    "not be what was meant",
                    found.flipped_edges));
  }
  if (const double buried = buried_share(mesh, distance, stop); buried > 0.0) {
    say(fmt::format("{:.2g} % of its surface lies inside it: parts that overlap are joined",
                    100.0 * buried));
  }
  return notes;
}

}  // namespace

Pose scene_from_shape(const ShapeOptions& shape) {
  Pose pose = turned_about_axes(shape.rotation_degrees);
  pose.translation = shape.position;
  return pose;
}

PlacedSolid::PlacedSolid(std::unique_ptr<SignedDistance> solid, const Pose& scene_from_solid)
    : solid_(std::move(solid)), solid_from_scene_(scene_from_solid.inverse()) {
  const Box box = solid_->bounds();
  TriangleMesh corners;
  for (int k = 0; k < 8; ++k) {
    corners.vertices.push_back(scene_from_solid.apply({(k & 1) != 0 ? box.high.x : box.low.x,
                                                       (k & 2) != 0 ? box.high.y : box.low.y,
                                                       (k & 4) != 0 ? box.high.z : box.low.z}));
  }
  bounds_ = opaline::render::bounds(corners);
}

Result<LoadedShape> load_shape(const ShapeOptions& shape,
                               const std::stop_token& stop,
                               const Saying& say) {
  const auto now = [&](std::string_view what) {
    if (say) say(fmt::format("{} {}", what, shape.file.filename().string()));
  };
  LoadedShape loaded;
  if (!shape.name.empty()) {
    auto solid = make_shape(shape.name, shape.size_mm);
    if (!solid) return solid.error();
    loaded.solid = std::make_unique<PlacedSolid>(*std::move(solid), scene_from_shape(shape));
    return loaded;
  }
  now("reading");
  auto surface = placed_surface(shape, loaded.tets, stop);
  if (!surface) return surface.error();
  now("the signed distance of");
  auto solid = MeshDistance::create(*surface, stop);
  if (!solid) return solid.error().in(shape.file.string());
  now("looking for holes and overlaps in");
  loaded.notes = notes_on(*surface, **solid, shape.file, stop);
  if (stop.stop_requested()) return cancelled("looking for holes");
  loaded.solid = *std::move(solid);
  loaded.surface = *std::move(surface);
  return loaded;
}

TriangleMesh plane_mesh(double size_mm, int cells) {
  TriangleMesh mesh;
  const double step = size_mm / cells;
  for (int j = 0; j <= cells; ++j) {
    for (int i = 0; i <= cells; ++i) {
      mesh.vertices.push_back({i * step - 0.5 * size_mm, j * step - 0.5 * size_mm, 0.0});
    }
  }
  for (int j = 0; j < cells; ++j) {
    for (int i = 0; i < cells; ++i) {
      const int a = j * (cells + 1) + i;
      const int b = a + cells + 1;
      mesh.triangles.push_back({a, a + 1, b + 1});
      mesh.triangles.push_back({a, b + 1, b});
    }
  }
  return mesh;
}

Result<LoadedShape> load_opaque(const ShapeOptions& shape,
                                double tetrahedra,
                                std::stop_token stop,
                                const Saying& say) {
  if (shape.name == "plane") {
    LoadedShape loaded;
    loaded.surface = plane_mesh(shape.size_mm, kPlaneCells);
    const Pose pose = scene_from_shape(shape);
    for (Vec3& p : loaded.surface->vertices) p = pose.apply(p);
    return loaded;
  }
  auto loaded = load_shape(shape, stop, say);
  if (!loaded || loaded->surface) return loaded;
  const double spacing = spacing_for(estimate_volume(*loaded->solid), tetrahedra);
  const auto tets = stuff(*loaded->solid, {.spacing_mm = spacing, .interior_growth = 1.0}, stop);
  if (!tets) return tets.error();
  loaded->surface = surface_mesh(*tets);
  return loaded;
}

}  // namespace opaline::render
