#include "daemon/cli/program_commands.h"

#include <CLI/CLI.hpp>

#include "daemon/cli/error_report.h"

namespace opaline::daemon {

void ProgramCommands::declare(CLI::App& app, const std::filesystem::path& programs, int& status) {
  declare_tradeoff(app, programs, status);
  declare_render(app, programs, status);
  declare_view(app, programs, status);
}

void ProgramCommands::declare_tradeoff(CLI::App& app,
                                       const std::filesystem::path& programs,
                                       int& status) {
  CLI::App* sub = app.add_subcommand(
      "tradeoff",
      "Measure seconds against accuracy on a session's own pictures, setting by setting");
  sub->add_option("DIR", tradeoff_.directory, "A session directory, or one with a dataset")
      ->required();
  sub->add_option(
      "--out", tradeoff_.out, "Directory for tradeoff.csv and tradeoff.svg; default DIR/tradeoff");
  sub->add_flag("--quick", tradeoff_.quick, "Only what takes seconds");
  sub->add_option("--limit", tradeoff_.limit_seconds, "Seconds after which a setting is given up")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  sub->footer(
      "Ctrl-C stops and keeps what was measured. What the settings mean: "
      "docs/accuracy.md\n\nExamples:\n"
      "  opaline tradeoff ~/sessions/20260131-123456-ab12cd-marble\n"
      "  opaline tradeoff --quick --out /tmp/front ~/sessions/20260131-123456-ab12cd-marble");
  sub->callback(
      [this, &programs, &status] { status = report(become_tradeoff(programs, tradeoff_)); });
}

void ProgramCommands::declare_render(CLI::App& app,
                                     const std::filesystem::path& programs,
                                     int& status) {
  CLI::App* sub = app.add_subcommand(
      "render",
      "Draw a scene of translucent and opaque objects, or a session's maps, without a daemon");
  sub->add_option("SCENE",
                  render_.scene,
                  "scene.toml (docs/rendering.md), or a session in a sphere of lights: its maps")
      ->required();
  sub->add_option("--output,-o", render_.outputs, "Picture: .png, .tif or .exr; may be given again")
      ->required();
  sub->add_option("--turntable",
                  render_.turntable,
                  "This many pictures of the objects' full turn, numbered NAME_000 and on")
      ->check(CLI::Range(0, 100000));
  sub->add_option("--stats", render_.stats, "File for the statistics as JSON, in place of text");
  sub->add_option(
         "--draw", render_.draw, "host: rays on the processor; vulkan: rasteriser and shadow maps")
      ->check(CLI::IsMember({"host", "vulkan"}))
      ->capture_default_str();
  sub->add_option("--device", render_.device, "Part of the name of the Vulkan device that draws");
  sub->add_option("--save-material",
                  render_.materials,
                  "OBJECT=FILE.vdb: the object's material with its edits; may be given again");
  sub->add_flag("--no-edits", render_.no_edits, "Leave out the edits of the scene");
  sub->add_flag("--at-rest", render_.at_rest, "Leave out the bending of the scene");
  sub->add_flag("--swing",
                render_.swing,
                "Over a turntable objects bend from rest to where the scene has them, and back");
  sub->add_option(
         "--light", render_.light, "Of a session: constant, gradient_x, gradient_y or gradient_z")
      ->capture_default_str();
  sub->add_option("--turn", render_.turn_deg, "Of a session: degrees to the right");
  sub->add_option("--tilt", render_.tilt_deg, "Of a session: degrees up");
  sub->add_option("--mesh",
                  render_.mesh,
                  "Of a session: OBJ with texture coordinates over the picture, in place of it");
  sub->add_option(
         "--mesh-size", render_.mesh_size_mm, "Its largest extent, mm; 0: its coordinates are mm")
      ->check(CLI::Range(0.0, 1e6));
  sub->add_option("--threads", render_.threads, "0: one a processor")->check(CLI::Range(0, 1024));
  sub->footer(
      "Ctrl-C stops; a picture is there whole or not at all.\n"
      "Exit status: 0 done, 1 failed, 2 bad scene, 3 stopped\n\nExamples:\n"
      "  opaline render config/scene_marble_torus.toml --output torus.png\n"
      "  opaline render scene.toml --output frame.png --output frame.exr --turntable 60\n"
      "  opaline render scene.toml --output picture.png --stats picture.json\n"
      "  opaline render scene.toml --output bend.png --turntable 24 --swing\n"
      "  opaline render scene.toml --output after.png --save-material ring=painted.vdb\n"
      "  opaline render SESSION --output maps.png --light gradient_x\n"
      "  opaline render SESSION --output turned.png --turn 35");
  sub->callback([this, &programs, &status] { status = report(become_render(programs, render_)); });
}

void ProgramCommands::declare_view(CLI::App& app,
                                   const std::filesystem::path& programs,
                                   int& status) {
  CLI::App* sub = app.add_subcommand(
      "view",
      "Open a window on a scene: light it, paint into it, bend it; or on a session's maps beside "
      "what was captured; without a daemon");
  sub->add_option("SCENE",
                  view_.scene,
                  "scene.toml (docs/rendering.md), or a session in a sphere of lights: its maps")
      ->required();
  sub->add_option("--do", view_.actions, "Does this, one thing a picture; may be given again");
  sub->add_option("--frames", view_.frames, "Ends after this many pictures")
      ->check(CLI::Range(0, 1'000'000));
  sub->add_option("--screenshot", view_.screenshot, "PNG of the window before it ends");
  sub->add_option("--step-pictures",
                  view_.step_pictures,
                  "Directory for a PNG of the window after each --do, named by number and verb");
  sub->add_option("--width", view_.width, "Of the window, pixels")->check(CLI::Range(64, 8192));
  sub->add_option("--height", view_.height, "Of the window, pixels")->check(CLI::Range(64, 8192));
  sub->add_option("--device", view_.device, "Part of the name of the Vulkan device");
  sub->add_flag("--validation", view_.validation, "Vulkan's validation layer; what it says fails");
  sub->add_option("--threads", view_.threads, "0: one a processor")->check(CLI::Range(0, 1024));
  sub->footer(
      "Exit status: 0 done, 1 failed, 2 bad scene, 3 stopped\n\nExamples:\n"
      "  opaline view config/scene_marble_torus.toml\n"
      "  opaline view scene.toml --do 'brush radius 2' --do 'paint 0.5 0.6' --do 'screenshot "
      "a.png'\n"
      "  opaline view scene.toml --frames 5 --screenshot window.png\n"
      "  opaline view SESSION --do 'light 0 90 0' --do 'orbit 30 0' --screenshot turned.png");
  sub->callback([this, &programs, &status] { status = report(become_view(programs, view_)); });
}

}  // namespace opaline::daemon
