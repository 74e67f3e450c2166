#include "daemon/scattering/sphere_shell.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "base/io/volume_io.h"
#include "daemon/jobs/version.h"
#include "daemon/scattering/sphere_session.h"

namespace opaline::daemon {
namespace {

using reconstruct::ScatteringMaps;

constexpr double kShellDepth = 3.0;  // l_d
constexpr double kFloor = 1e-5;      // 1/mm, so that logarithms exist

double highest(const Relief& r) {
  double most = r.cell_mm;
  for (const float z : r.height_mm)
    if (std::isfinite(z)) most = std::max<double>(most, z);
  return most;
}

Result<void> fill_channel(const Relief& r,
                          const ScatteringMaps& maps,
                          const Block& block,
                          double front,
                          ChannelCoefficients& c) {
  const auto found = nearest_maps(r, maps);
  if (!found) return found.error();
  const ReliefMaps& layer = *found;
  const double absorption = std::max(kFloor, median_of(maps, maps.absorption));
  const double scattering = std::max(kFloor, median_of(maps, maps.reduced_scattering));
  c.absorption.assign(block.cell_count(), absorption);
  c.reduced_scattering.assign(block.cell_count(), scattering);
  for (int k = 0; k < block.nz; ++k)
    for (int j = 0; j < block.ny; ++j)
      for (int i = 0; i < block.nx; ++i) {
        const int y = r.height - 1 - j;
        if (!r.has(i, y)) continue;
        const std::size_t from = r.index(i, y);
        const double deep = r.at(i, y) - ((k + 0.5) * block.hz - front);
        if (deep > kShellDepth * layer.translucency[from]) continue;
        c.absorption[block.index(i, j, k)] = std::max<double>(kFloor, layer.absorption[from]);
        c.reduced_scattering[block.index(i, j, k)] =
            std::max<double>(kFloor, layer.reduced_scattering[from]);
      }
  return ok();
}

std::string scene_text(const SphereSession& session,
                       const Relief& relief,
                       const Material& shell,
                       const std::string& name) {
  const Vec3 origin = shell_origin(relief, shell);
  const double tall = relief.height * relief.cell_mm;
  const double far = session.record.distance_mm > 0.0 ? session.record.distance_mm : 1000.0;
  return fmt::format(
      R"(# The object as its maps say, under even light, from where the camera stood.
#   opaline render scene.toml --output rendered.png
name = "{}"

[picture]
width = {}
height = {}

[camera]
position = ["0 mm", "0 mm", "{:.3f} mm"]
target = ["0 mm", "0 mm", "0 mm"]
up = [0.0, 1.0, 0.0]
field_of_view = "{:.5f} deg"

[environment]
radiance = [1.0, 1.0, 1.0]
rays = 0

[[objects]]
name = "shell"
file = "shell.obj"
size = "0 mm"
specular = "none"

[objects.material]
file = "material.vdb"
origin = ["{:.4f} mm", "{:.4f} mm", "{:.4f} mm"]
tiling = "clamp"
)",
      name,
      std::max(64, relief.width * relief.step),
      std::max(64, relief.height * relief.step),
      far,
      2.0 * std::atan(0.5 * tall / far) * 180.0 / 3.14159265358979,
      origin.x,
      origin.y,
      origin.z);
}

}  // namespace

Vec3 shell_origin(const Relief& r, const Material& shell) {
  return {-0.5 * r.width * r.cell_mm,
          -0.5 * r.height * r.cell_mm,
          -0.5 * shell.block.nz * shell.block.hz};
}

Result<Material> shell_of(const SphereMaps& maps,
                          const SphereSession&,
                          const Relief& relief,
                          double ior,
                          std::string name) {
  const double most = highest(relief);
  Material shell;
  shell.block.nx = relief.width;
  shell.block.ny = relief.height;
  shell.block.nz = std::max(2, 2 * static_cast<int>(std::ceil(most / relief.cell_mm)));
  shell.block.hx = shell.block.hy = shell.block.hz = relief.cell_mm;
  shell.ior = ior;
  shell.name = std::move(name);
  for (std::size_t c = 0; c < 3; ++c) {
    auto filled = fill_channel(relief,
                               maps.channels[c],
                               shell.block,
                               0.5 * shell.block.nz * shell.block.hz,
                               shell.channels[c]);
    if (!filled) return filled.error().in(kChannelNames[c]);
  }
  return shell;
}

Result<void> write_shell(FileOperations& files,
                         const SessionDirectory& directory,
                         const SphereMaps& maps,
                         const SphereSession& session,
                         double ior,
                         const std::string& name) {
  const Relief relief = relief_of(maps, session);
  const auto shell = shell_of(maps, session, relief, ior, name);
  if (!shell) return shell.error();
  if (auto written = write_material(
          files, directory.material(), *shell, fmt::format("opaline-reconstruct {}", version()));
      !written)
    return written;
  if (auto written = write_whole(files, directory.path() / "shell.obj", relief_obj(relief));
      !written)
    return written;
  return write_whole(
      files, directory.path() / "scene.toml", scene_text(session, relief, *shell, directory.id()));
}

}  // namespace opaline::daemon
