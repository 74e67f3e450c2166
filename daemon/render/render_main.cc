// opaline-render: pictures of a scene file.

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <numbers>
#include <thread>

#include "base/clock.h"
#include "base/files.h"
#include "config/scene_config.h"
#include "daemon/cli/progress_view.h"
#include "daemon/cli/terminal.h"
#include "daemon/jobs/command_program.h"
#include "daemon/jobs/program.h"
#include "daemon/jobs/stop_signals.h"
#include "daemon/jobs/version.h"
#include "daemon/render/developed_picture.h"
#include "daemon/render/maps_picture.h"
#include "daemon/render/render_report.h"
#include "daemon/render/scene_view.h"
#include "daemon/render/turntable.h"
#include "daemon/scattering/maps_scene.h"

namespace opaline::daemon {
namespace {

namespace fs = std::filesystem;
using render::SceneRenderer;

struct Arguments {
  fs::path scene;
  std::vector<fs::path> outputs;
  int turntable = 0;
  fs::path stats;
  std::vector<std::string> materials;
  std::string draw = "host";
  std::string device;
  bool no_edits = false;
  bool at_rest = false;
  bool swing = false;
  int threads = 0;
  MapsPictureOptions maps;  // where SCENE is a session's directory
};

struct Output {
  fs::path file;
  ImageFormat format;
};

Result<std::vector<Output>> outputs_of(const Arguments& arguments) {
  std::vector<Output> outputs;
  for (const fs::path& file : arguments.outputs) {
    const auto format = image_format_of(file.string());
    if (!format) return format.error();
    const fs::path directory = fs::absolute(file).parent_path();
    std::error_code none;
    if (!fs::is_directory(directory, none)) {
      return not_found(fmt::format("{}: no such directory", directory.string()));
    }
    outputs.push_back({file, *format});
  }
  return outputs;
}

/// "NAME=FILE" of --save-material: the object's place in the scene, and the file.
Result<std::pair<std::size_t, fs::path>> material_to_save(const render::Scene& scene,
                                                          const std::string& text) {
  const auto equals = text.find('=');
  const std::string name = text.substr(0, equals);
  for (std::size_t o = 0; o < scene.objects.size() && equals != std::string::npos; ++o) {
    if (scene.objects[o].name != name) continue;
    if (scene.objects[o].kind == render::ObjectOptions::Kind::kOpaque) {
      return invalid_argument(fmt::format("--save-material {}: \"{}\" is opaque", text, name));
    }
    return std::pair(o, fs::path(text.substr(equals + 1)));
  }
  return invalid_argument(fmt::format(
      "--save-material {}: expected OBJECT=FILE.vdb with an object of the scene", text));
}

class Session {
 public:
  Session(const Arguments& arguments, render::Scene scene, std::vector<Output> outputs)
      : arguments_(arguments), scene_(std::move(scene)), outputs_(std::move(outputs)) {}

  Result<void> run(ThreadTeam& team, const std::stop_token& stop) {
    render::Scene first = scene_;
    for (render::ObjectOptions& object : first.objects) {
      if (arguments_.swing) object.deform = {};
    }
    gpu::ContextOptions gpu;
    gpu.device.name = arguments_.device;
    const auto view = SceneView::create(
        first,
        arguments_.draw == "vulkan" ? DrawBy::kVulkan : DrawBy::kHost,
        gpu,
        team,
        [&](std::string_view what, double share) { show(what, 0.5 * share); },
        stop);
    if (!view) return view.error().in(arguments_.scene.string());
    SceneRenderer& renderer = (*view)->renderer();
    for (const std::string& text : arguments_.materials) {
      if (auto saved = save_material(renderer, text); !saved) return saved;
    }
    const int pictures = std::max(1, arguments_.turntable);
    for (int k = 0; k < pictures; ++k) {
      show(fmt::format("picture {} of {}", k + 1, pictures), 0.5 + 0.5 * k / pictures);
      if (auto drawn = picture(**view, k, pictures, stop); !drawn) return drawn;
    }
    return report(renderer.statistics());
  }

 private:
  void show(std::string_view step, double fraction) {
    view_.on_event("progress", {{"step", step}, {"fraction", fraction}});
  }

  Result<void> save_material(SceneRenderer& renderer, const std::string& text) {
    const auto what = material_to_save(scene_, text);
    if (!what) return what.error();
    const auto origin =
        renderer.body(what->first)
            ->save(system_files(), what->second, fmt::format("opaline-render {}", version()));
    if (!origin) return origin.error();
    view_.say(fmt::format("material  {}: origin = [\"{} mm\", \"{} mm\", \"{} mm\"]",
                          what->second.string(),
                          origin->x,
                          origin->y,
                          origin->z));
    return ok();
  }

  /// From rest to the full bend and back, once around.
  Result<void> swing(SceneRenderer& renderer, double share, const std::stop_token& stop) {
    for (std::size_t o = 0; o < scene_.objects.size(); ++o) {
      render::DeformOptions deform = scene_.objects[o].deform;
      if (deform.kind == render::DeformOptions::Kind::kNone) continue;
      deform.amount *= 0.5 - 0.5 * std::cos(2.0 * std::numbers::pi * share);
      const auto bent = renderer.bend(o, deform, stop);
      if (!bent) return bent.error().in(fmt::format("object \"{}\"", scene_.objects[o].name));
    }
    return ok();
  }

  Result<void> picture(SceneView& view, int k, int pictures, const std::stop_token& stop) {
    const TurnedView turn = turned(scene_, 360.0 * k / pictures);
    if (arguments_.swing) {
      const double share = static_cast<double>(k) / pictures;
      if (auto bent = swing(view.renderer(), share, stop); !bent) return bent;
    }
    const auto radiance = view.picture(turn.lights, turn.camera, stop);
    if (!radiance) return radiance.error();
    if (k == 0) white_ = white_of(*radiance, scene_.picture);
    for (const Output& output : outputs_) {
      const auto bytes = developed(*radiance, white_, scene_.picture, output.format);
      if (!bytes) return bytes.error().in(output.file.string());
      const fs::path file = numbered(output.file, k, pictures);
      if (auto written = write_whole(system_files(), file, *bytes); !written) return written;
      view_.say(fmt::format("picture  {}", file.string()));
    }
    return ok();
  }

  Result<void> report(const render::SceneStatistics& statistics) {
    if (arguments_.stats.empty()) {
      std::fflush(stdout);
      fmt::print(stderr, "{}white: {:.4g} W/(mm^2 sr)\n", to_text(statistics), white_);
      return ok();
    }
    nlohmann::json json = to_json(statistics);
    json["white"] = white_;
    json["scene"] = scene_.name;
    return write_whole(system_files(), arguments_.stats, json.dump(2) + "\n");
  }

  const Arguments& arguments_;
  render::Scene scene_;
  std::vector<Output> outputs_;
  SystemClock clock_;
  ProgressView view_{terminal_options(), clock_};
  double white_ = 1.0;
};

/// A session's maps in place of a scene.
Result<void> run_maps(const Arguments& arguments) {
  MapsPictureOptions options = arguments.maps;
  options.session = arguments.scene;
  options.outputs = arguments.outputs;
  options.turntable = arguments.turntable;
  if (!arguments.stats.empty() || !arguments.materials.empty() || arguments.draw != "host" ||
      arguments.no_edits || arguments.at_rest || arguments.swing)
    return invalid_argument(
        "--stats, --draw, --save-material, --no-edits, --at-rest and --swing are of scenes; this "
        "is a session: give its scene.toml");
  std::stop_source stop;
  const auto signals = StopSignals::watch([&](int) { stop.request_stop(); });
  if (!signals) return signals.error();
  return draw_maps(
      options,
      [](const fs::path& file) { fmt::print("picture  {}\n", file.string()); },
      stop.get_token());
}

Result<void> run(const Arguments& arguments) {
  auto outputs = outputs_of(arguments);
  if (!outputs) return outputs.error();
  if (is_session_directory(arguments.scene)) return run_maps(arguments);
  if (arguments.maps.is_asked_for())
    return invalid_argument(
        "--light, --turn, --tilt, --mesh and --mesh-size are of a session's maps; this is a scene");
  auto scene = config::load_scene(arguments.scene);
  if (!scene) return scene.error();
  for (render::ObjectOptions& object : scene->objects) {
    if (arguments.no_edits) object.edits.clear();
    if (arguments.at_rest) object.deform = {};
  }
  for (const std::string& text : arguments.materials) {
    if (auto what = material_to_save(*scene, text); !what) return what.error();
  }
  std::stop_source stop;
  const auto signals = StopSignals::watch([&](int) { stop.request_stop(); });
  if (!signals) return signals.error();
  const auto processors = static_cast<int>(std::max(1U, std::thread::hardware_concurrency()));
  ThreadTeam team(arguments.threads > 0 ? arguments.threads : processors);
  return Session(arguments, *std::move(scene), *std::move(outputs)).run(team, stop.get_token());
}

int program(int argc, char** argv) {
  CLI::App app("Draws a scene of translucent and opaque objects.");
  Arguments arguments;
  app.add_option("SCENE",
                 arguments.scene,
                 "scene.toml (docs/rendering.md), or a session in a sphere of lights: its maps")
      ->required();
  app.add_option(
         "--output,-o", arguments.outputs, "Picture: .png, .tif or .exr; may be given again")
      ->required();
  app.add_option("--turntable",
                 arguments.turntable,
                 "This many pictures of the objects' full turn, numbered NAME_000 and on")
      ->check(CLI::Range(0, 100000));
  app.add_option("--stats", arguments.stats, "File for the statistics as JSON, in place of text");
  app.add_option("--draw",
                 arguments.draw,
                 "host: rays on the processor; vulkan: rasteriser and shadow maps")
      ->check(CLI::IsMember({"host", "vulkan"}))
      ->capture_default_str();
  app.add_option("--device", arguments.device, "Part of the name of the Vulkan device that draws");
  app.add_option("--save-material",
                 arguments.materials,
                 "OBJECT=FILE.vdb: the object's material with its edits; may be given again");
  app.add_flag("--no-edits", arguments.no_edits, "Leaves out the edits of the scene");
  app.add_flag("--at-rest", arguments.at_rest, "Leaves out the bending of the scene");
  app.add_flag("--swing",
               arguments.swing,
               "Over a turntable objects bend from rest to where the scene has them, and back");
  app.add_option("--light",
                 arguments.maps.light,
                 "Of a session: constant, gradient_x, gradient_y or gradient_z")
      ->capture_default_str();
  app.add_option("--turn", arguments.maps.turn_deg, "Of a session: degrees to the right");
  app.add_option("--tilt", arguments.maps.tilt_deg, "Of a session: degrees up");
  app.add_option("--mesh",
                 arguments.maps.mesh,
                 "Of a session: OBJ with texture coordinates over the picture, in place of it");
  app.add_option("--mesh-size",
                 arguments.maps.mesh_size_mm,
                 "Its largest extent, mm; 0: its coordinates are mm")
      ->check(CLI::Range(0.0, 1e6));
  app.add_option("--threads", arguments.threads, "0: one a processor")->check(CLI::Range(0, 1024));
  app.footer(
      "Ctrl-C stops; a picture is there whole or not at all.\n"
      "Exit status: 0 done, 1 failed, 2 bad scene, 3 stopped\n\nExamples:\n"
      "  opaline-render config/scene_marble_torus.toml --output torus.png\n"
      "  opaline-render scene.toml --output frame.png --output frame.exr --turntable 60\n"
      "  opaline-render scene.toml --output bend.png --turntable 24 --swing\n"
      "  opaline-render scene.toml --output after.png --save-material ring=painted.vdb\n"
      "  opaline-render SESSION --output maps.png --light gradient_x\n"
      "  opaline-render SESSION --output turned.png --turn 35");
  return run_command(app, "opaline-render", argc, argv, [&] { return run(arguments); });
}

}  // namespace
}  // namespace opaline::daemon

int main(int argc, char** argv) {
  return opaline::daemon::run_program(argc, argv, opaline::daemon::program);
}
