#include "daemon/render/render_report.h"

#include <fmt/format.h>

namespace opaline::daemon {
namespace {

using render::SceneStatistics;

std::string name_of(render::DiffuseEntry entry) {
  switch (entry) {
    case render::DiffuseEntry::kAtSurface:
      return "at the surface";
    case render::DiffuseEntry::kFollowed:
      return "followed";
    case render::DiffuseEntry::kFollowedBefore:
      return "followed before";
    case render::DiffuseEntry::kDark:
      break;
  }
  return "dark";
}

nlohmann::json object_json(const SceneStatistics::Object& object) {
  nlohmann::json json{{"name", object.name},
                      {"kind", object.translucent ? "translucent" : "opaque"},
                      {"triangles", object.triangles}};
  if (!object.translucent) return json;
  json["tetrahedra"] = object.body.tetrahedra;
  json["unknowns"] = object.body.unknowns;
  json["spacing_mm"] = object.body.spacing_mm;
  json["volume_mm3"] = object.body.volume_mm3;
  json["smallest_dihedral_degrees"] = object.body.smallest_dihedral;
  json["components"] = object.body.components;
  json["iterations"] = object.iterations;
  json["relative_residual"] = object.relative_residual;
  json["environment_entry"] = name_of(object.environment);
  json["lamps_entry"] = name_of(object.lamps);
  return json;
}

std::string object_line(const SceneStatistics::Object& object) {
  if (!object.translucent)
    return fmt::format("{}: opaque, {} triangles\n", object.name, object.triangles);
  return fmt::format(
      "{}: {} tetrahedra of {:.3g} mm, angles from {:.1f} degrees; {} unknowns, {} iterations to a "
      "relative residual of {:.1e}; {} triangles; diffuse light: of the environment {}, of lamps "
      "{}\n",
      object.name,
      object.body.tetrahedra,
      object.body.spacing_mm,
      object.body.smallest_dihedral,
      object.body.unknowns,
      object.iterations,
      object.relative_residual,
      object.triangles,
      name_of(object.environment),
      name_of(object.lamps));
}

}  // namespace

nlohmann::json to_json(const SceneStatistics& statistics) {
  nlohmann::json objects = nlohmann::json::array();
  for (const auto& object : statistics.objects) objects.push_back(object_json(object));
  return {{"objects", objects},
          {"seconds",
           {{"load", statistics.load_seconds},
            {"mesh", statistics.mesh_seconds},
            {"setup", statistics.setup_seconds},
            {"light", statistics.light_seconds},
            {"solve", statistics.solve_seconds},
            {"draw", statistics.draw_seconds}}},
          {"left_out", statistics.left_out},
          {"notes", statistics.notes}};
}

std::string to_text(const SceneStatistics& statistics) {
  std::string text;
  for (const auto& object : statistics.objects) text += object_line(object);
  text += fmt::format(
      "seconds: load {:.2f}, mesh {:.2f}, set-up {:.2f}; last picture: light {:.2f}, solve {:.2f}, "
      "draw {:.2f}\n",
      statistics.load_seconds,
      statistics.mesh_seconds,
      statistics.setup_seconds,
      statistics.light_seconds,
      statistics.solve_seconds,
      statistics.draw_seconds);
  for (const std::string& what : statistics.left_out) text += fmt::format("left out: {}\n", what);
  for (const std::string& note : statistics.notes) text += fmt::format("note: {}\n", note);
  return text;
}

}  // namespace opaline::daemon
