#include "daemon/preview/object_scene.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

namespace opaline::daemon {
namespace {

constexpr std::string_view kHead =
    R"(# An object of this session's material. docs/rendering.md explains every key.
#   opaline render object.toml --output picture.png
#   opaline view object.toml
# "opaline-preview" draws this file as it is when it runs: what is changed here stays. Removed, it is written anew.

name = "an object of session {id}"

[picture]
width = 640
height = 480
samples = {samples}
background = [0.01, 0.012, 0.015]

[camera]
position = ["{camera_x:.6g} mm", "{camera_y:.6g} mm", "{camera_z:.6g} mm"]
target = ["0 mm", "0 mm", "{target_z:.6g} mm"]
field_of_view = "28 deg"

[environment]
radiance = [0.02, 0.022, 0.026]
rays = 64

[diffusion]
tetrahedra = {tetrahedra:.6g}
tolerance = {tolerance:.6g}
)";

constexpr std::string_view kThings = R"(
[[lights]]
name = "sun, from behind"
kind = "directional"
direction = [-0.5, -1.0, -0.9]
irradiance = [1.0, 0.95, 0.85]

[[objects]]
name = "floor"
kind = "opaque"
shape = "plane"
size = "{floor:.6g} mm"
position = ["0 mm", "0 mm", "{floor_z:.6g} mm"]
reflectance = [0.32, 0.3, 0.28]

[[objects]]
name = "object"
kind = "translucent"
shape = "{shape}"
size = "{size:.6g} mm"
specular = "none"

[objects.material]
file = "../material.vdb"
origin = ["{origin_x:.6g} mm", "{origin_y:.6g} mm", "{origin_z:.6g} mm"]
tiling = "mirror"
{surface})";

/// How far a shape reaches below its middle, in shares of its size (render/mesh/shapes.h).
double below(std::string_view shape) {
  if (shape == "torus" || shape == "genus3") return 0.125;
  if (shape == "knot") return 0.25;
  return shape == "sheet" ? 0.0125 : 0.5;
}

}  // namespace

std::filesystem::path object_scene_file(const SessionDirectory& session) {
  return session.preview() / "object.toml";
}

std::string object_scene(const SessionDirectory& session, const config::SessionConfig& config) {
  using fmt::arg;
  const config::PreviewOptions& preview = config.preview;
  const Vec3 extent = config.sample.block.size();
  const double size = std::min(extent.x, extent.y);
  const double floor_z = -(below(preview.object) + 0.05) * size;
  const double distance = preview.object == "sphere" || preview.object == "figurine" ? 1.4 : 1.0;
  std::error_code none;
  const bool has_surface = std::filesystem::exists(session.surface(), none);
  return fmt::format(fmt::runtime(kHead),
                     arg("id", session.id()),
                     arg("samples", preview.samples_per_axis),
                     arg("camera_x", 1.13 * distance * size),
                     arg("camera_y", -1.33 * distance * size),
                     arg("camera_z", 1.07 * distance * size),
                     arg("target_z", -0.03 * size),
                     arg("tetrahedra", preview.object_tetrahedra),
                     arg("tolerance", std::max(preview.tolerance, 1e-5))) +
         fmt::format(
             fmt::runtime(kThings),
             arg("floor", 5.0 * size),
             arg("floor_z", floor_z),
             arg("shape", preview.object),
             arg("size", size),
             arg("origin_x", -0.5 * extent.x),
             arg("origin_y", -0.5 * extent.y),
             arg("origin_z", -0.5 * extent.z),
             arg("surface",
                 has_surface ? "surface_reflectance = \"../surface_reflectance.exr\"\n" : ""));
}

Result<void> write_object_scene(FileOperations& files,
                                const SessionDirectory& session,
                                const config::SessionConfig& config) {
  const std::filesystem::path file = object_scene_file(session);
  std::error_code none;
  if (std::filesystem::exists(file, none)) return ok();
  if (auto made = files.make_directories(session.preview()); !made) return made;
  return write_whole(files, file, object_scene(session, config));
}

}  // namespace opaline::daemon
