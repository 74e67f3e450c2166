// opaline-view: a window on a scene.

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <span>
#include <thread>

#include "base/files.h"
#include "base/io/image_io.h"
#include "base/log.h"
#include "config/scene_config.h"
#include "daemon/jobs/command_program.h"
#include "daemon/jobs/program.h"
#include "daemon/jobs/stop_signals.h"
#include "daemon/jobs/version.h"
#include "daemon/scattering/maps_scene.h"
#include "daemon/view/maps_viewing.h"
#include "daemon/view/view_panels.h"
#include "daemon/view/view_script.h"
#include "daemon/view/view_window.h"
#include "render/view/view_model.h"

namespace opaline::daemon {
namespace {

namespace fs = std::filesystem;

constexpr double kIdleSeconds = 0.02;
constexpr double kMinimisedSeconds = 0.1;
constexpr int kMostWindowLosses = 3;
constexpr double kPixelsBetweenDabs = 4.0;  // as a pulled mouse leaves them

struct Arguments {
  fs::path scene;
  std::vector<std::string> actions;
  int frames = 0;
  int width = 1280;
  int height = 800;
  fs::path screenshot;
  fs::path step_pictures;
  std::string device;
  bool validation = gpu::ContextOptions::validation_from_environment();
  int threads = 0;
};

class Viewing {
 public:
  Viewing(const Arguments& arguments, std::vector<ViewAction> script)
      : arguments_(arguments), script_(std::move(script)) {}

  Result<void> run(const render::Scene& scene, ThreadTeam& team, const std::stop_token& stop) {
    render::RasterOptions raster;
    raster.gpu.device.name = arguments_.device;
    raster.gpu.validation = arguments_.validation;
    raster.gpu.on_validation_message = [this](std::string_view m) { complain(m); };
    auto model = render::ViewModel::create(
        scene,
        raster,
        team,
        [](std::string_view what, double) { fmt::print(stderr, "{}\n", what); },
        stop);
    if (!model) return model.error().in(arguments_.scene.string());
    model_ = *std::move(model);
    if (auto opened = open(); !opened) return opened;
    while (!stop.stop_requested() && !window_->wants_to_close() && !is_over()) {
      if (auto stepped = step(stop); !stepped) return stepped;
    }
    window_.reset();
    model_.reset();
    if (complaints_ > 0) {
      return internal_error(fmt::format("{} messages of the validation layer", complaints_));
    }
    return ok();
  }

 private:
  void complain(std::string_view message) {
    ++complaints_;
    fmt::print(stderr, "Vulkan: {}\n", message);
  }

  Result<void> open() {
    auto window = ViewWindow::create(
        {.title = fmt::format("Opaline: {}", arguments_.scene.filename().string()),
         .width = arguments_.width,
         .height = arguments_.height,
         .device = arguments_.device,
         .validation = arguments_.validation,
         .on_validation_message = [this](std::string_view m) { complain(m); }});
    if (!window) return window.error();
    window_ = *std::move(window);
    return ok();
  }

  bool is_over() const {
    const bool told = !script_.empty() || arguments_.frames > 0;
    return told && next_ >= script_.size() && wait_ == 0 && shown_ >= arguments_.frames &&
           screenshot_.empty();
  }

  bool is_last() const {
    return shown_ + 1 >= arguments_.frames && next_ >= script_.size() && wait_ == 0 && !finished_ &&
           !arguments_.screenshot.empty();
  }

  /// One picture, and before it one thing of the script.
  Result<void> step(const std::stop_token& stop) {
    const auto start = std::chrono::steady_clock::now();
    if (wait_ > 0) --wait_;
    if (auto done = act(); !done) return done;
    window_->listen(minimised_ ? kMinimisedSeconds : changed_ ? 0.0 : kIdleSeconds);
    const auto size = window_->size();
    minimised_ = !size;
    if (minimised_) return ok();
    window_->begin();
    follow_mouse(*model_, desk_, size->width, size->height);
    draw_panels(*model_, desk_);
    if (auto drawn = draw(*size, stop); !drawn) return drawn;
    const bool last = is_last();
    if (last && !finished_ && !arguments_.screenshot.empty()) screenshot_ = arguments_.screenshot;
    finished_ = finished_ || last;
    auto shown = show();
    desk_.frame_seconds =
        std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    return shown;
  }

  Result<void> draw(ViewWindow::Size size, const std::stop_token& stop) {
    const int width = std::max(1, static_cast<int>(desk_.resolution * size.width));
    const int height = std::max(1, static_cast<int>(desk_.resolution * size.height));
    if (auto caught = model_->catch_up(); !caught) desk_.message = caught.error().message;
    const bool settled = !screenshot_.empty() || is_last();  // what is kept shows its own light
    changed_ = !picture_ || picture_->width() != width || picture_->height() != height ||
               version_ != model_->version() || exposure_ != desk_.exposure ||
               (settled && model_->is_lighting());
    if (!changed_) return ok();
    auto drawn = settled ? model_->picture(width, height, desk_.exposure, stop)
                         : model_->picture_now(width, height, desk_.exposure, stop);
    if (!drawn) return drawn.error();
    picture_ = *std::move(drawn);
    version_ = model_->version();
    exposure_ = desk_.exposure;
    return ok();
  }

  Result<void> show() {
    Image<std::uint8_t> seen;
    const bool keep = !screenshot_.empty();
    const auto shown = window_->present(*picture_, keep ? &seen : nullptr);
    if (!shown) return lost(shown.error());
    if (!*shown) return ok();
    ++shown_;
    window_losses_ = 0;
    return keep ? keep_screenshot(std::move(seen)) : ok();
  }

  Result<void> keep_screenshot(Image<std::uint8_t> seen) {
    const auto bytes = encode_image({std::move(seen), {}, {}}, ImageFormat::kPng);
    if (!bytes) return bytes.error();
    auto written = write_whole(system_files(), screenshot_, *bytes);
    if (written) {
      fmt::print(stderr, "picture  {}{}\n", screenshot_.string(), light_in_words());
    }
    screenshot_.clear();
    return written;
  }

  /// How the light that is shown was found: "; ring: 6 iterations to 4.5e-05, 73 ms".
  std::string light_in_words() const {
    const render::SceneStatistics& s = model_->statistics();
    std::string text;
    for (const auto& object : s.objects) {
      if (!object.translucent) continue;
      text += fmt::format("{} {}: {} iterations to {:.1e}",
                          text.empty() ? ";" : ",",
                          object.name,
                          object.iterations,
                          object.relative_residual);
    }
    return text + fmt::format(", {:.0f} ms", 1e3 * s.solve_seconds);
  }

  /// The window's device is gone: another window, unless that has happened again and again.
  Result<void> lost(const Error& error) {
    if (++window_losses_ > kMostWindowLosses) return error;
    log::warning("{}; the window is opened again", error.message);
    window_.reset();
    return open();
  }

  Result<void> act() {
    if (wait_ > 0 || next_ >= script_.size() || !screenshot_.empty()) return ok();
    if (minimised_ && script_[next_].verb == "screenshot") {
      return invalid_argument("screenshot: the window is minimised");
    }
    const ViewAction& action = script_[next_++];
    if (auto done = perform(action); !done) return done.error().in(action.verb);
    const bool can_be_seen = !minimised_ && action.verb != "minimise" && action.verb != "wait";
    if (!arguments_.step_pictures.empty() && screenshot_.empty() && can_be_seen) {
      screenshot_ = arguments_.step_pictures / fmt::format("{:02}-{}.png", next_, action.verb);
    }
    return ok();
  }

  Result<void> perform(const ViewAction& a) {
    if (a.verb == "orbit") model_->orbit(a.number(0), a.number(1));
    if (a.verb == "zoom") model_->zoom(a.number(0));
    if (a.verb == "pan") model_->pan(a.number(0), a.number(1));
    if (a.verb == "light") {
      model_->turn_light(static_cast<std::size_t>(a.number(0)), a.number(1), a.number(2));
    }
    if (a.verb == "exposure") desk_.exposure = a.number(0);
    if (a.verb == "tolerance") model_->set_tolerance(a.number(0));
    if (a.verb == "resize") {
      window_->resize(static_cast<int>(a.number(0)), static_cast<int>(a.number(1)));
    }
    if (a.verb == "minimise") window_->minimise();
    if (a.verb == "restore") window_->restore();
    if (a.verb == "lose") model_->lose_device();
    if (a.verb == "wait") wait_ = static_cast<int>(a.number(0));
    if (a.verb == "screenshot") screenshot_ = a.words[0];
    return edit(a);
  }

  Result<void> edit(const ViewAction& a) {
    if (a.verb == "brush") return set_brush(desk_.brush, a.words[0], a.words[1]);
    if (a.verb == "paint") return paint({a.number(0), a.number(1)}, {a.number(0), a.number(1)});
    if (a.verb == "stroke") return paint({a.number(0), a.number(1)}, {a.number(2), a.number(3)});
    if (a.verb == "undo") return exchanged(a.verb, model_->undo(), "taken back");
    if (a.verb == "redo") return exchanged(a.verb, model_->redo(), "done again");
    if (a.verb == "save") return save(a.words[0], a.words[1]);
    if (a.verb == "bend") return bend(a.words[0], a.number(1));
    return ok();
  }

  void tell(const std::string& verb, const std::string& what) {
    desk_.message = what;
    fmt::print(stderr, "{:<8} {}\n", verb, what);
  }

  Result<void> exchanged(const std::string& verb, const Result<bool>& done, const char* what) {
    if (!done) return done.error();
    tell(verb, *done ? what : "there is none");
    return ok();
  }

  Result<void> save(const std::string& object, const std::string& file) {
    const auto saved = save_object(*model_, object, file);
    if (!saved) return saved.error();
    tell("save", *saved);
    return ok();
  }

  /// A place in the window; 0 to 1, from its upper left corner.
  struct Share {
    double x = 0.0;
    double y = 0.0;
  };

  /// One stroke, dab after dab.
  Result<void> paint(Share from, Share to) {
    const auto size = window_->size();
    if (!size) return invalid_argument("the window is minimised");
    const double pixels = std::hypot((to.x - from.x) * size->width, (to.y - from.y) * size->height);
    const int steps = static_cast<int>(std::ceil(pixels / kPixelsBetweenDabs));
    std::size_t changed = 0;
    int misses = 0;
    for (int k = 0; k <= steps; ++k) {
      const double t = steps > 0 ? static_cast<double>(k) / steps : 0.0;
      const double x = (from.x + t * (to.x - from.x)) * size->width;
      const double y = (from.y + t * (to.y - from.y)) * size->height;
      const auto cells = model_->paint(x, y, size->width, size->height, desk_.brush, k > 0);
      if (!cells) return cells.error();
      changed += *cells;
      misses += *cells == 0 ? 1 : 0;
    }
    std::string text = fmt::format("{} cells", changed);
    if (steps > 0) text += fmt::format(" by {} dabs", steps + 1 - misses);
    if (changed == 0) text += why_nothing(from.x * size->width, from.y * size->height, *size);
    tell("paint", text);
    return ok();
  }

  std::string why_nothing(double x, double y, ViewWindow::Size size) {
    const auto place = model_->at(x, y, size.width, size.height);
    if (!place) return ": nothing is seen there";
    const auto& object = model_->scene().objects[place->object];
    if (object.kind != render::ObjectOptions::Kind::kTranslucent) {
      return fmt::format(": {} is seen there, which is opaque", object.name);
    }
    return fmt::format(": {} is already so there", object.name);
  }

  Result<void> bend(const std::string& name, double amount) {
    const auto& objects = model_->scene().objects;
    const auto found = std::ranges::find(objects, name, &render::ObjectOptions::name);
    if (found == objects.end()) return not_found(fmt::format("no object \"{}\"", name));
    const auto inverted = model_->bend(static_cast<std::size_t>(found - objects.begin()), amount);
    if (!inverted) return inverted.error();
    if (*inverted > 0) tell("bend", fmt::format("{} tetrahedra are inverted", *inverted));
    return ok();
  }

  const Arguments& arguments_;
  std::vector<ViewAction> script_;
  std::atomic<int> complaints_{0};
  std::unique_ptr<render::ViewModel> model_;
  std::unique_ptr<ViewWindow> window_;
  ViewDesk desk_;
  std::optional<Image<std::uint8_t>> picture_;
  std::uint64_t version_ = 0;
  double exposure_ = 0.0;
  bool changed_ = true;
  bool minimised_ = false;
  bool finished_ = false;
  std::size_t next_ = 0;
  int wait_ = 0;
  int shown_ = 0;
  int window_losses_ = 0;
  fs::path screenshot_;
};

/// A session's maps in place of a scene.
Result<void> run_maps(const Arguments& a,
                      std::span<const ViewAction> script,
                      std::stop_token stop) {
  return view_maps({.session = a.scene,
                    .script = script,
                    .frames = a.frames,
                    .screenshot = a.screenshot,
                    .window = {.title = fmt::format("Opaline: {}", a.scene.filename().string()),
                               .width = a.width,
                               .height = a.height,
                               .device = a.device,
                               .validation = a.validation,
                               .on_validation_message = {}}},
                   std::move(stop));
}

Result<void> run(const Arguments& arguments) {
  std::vector<ViewAction> script;
  for (const std::string& text : arguments.actions) {
    auto action = parse_view_action(text);
    if (!action) return action.error().in("--do");
    script.push_back(*std::move(action));
  }
  std::stop_source stop;
  const auto signals = StopSignals::watch([&](int) { stop.request_stop(); });
  if (!signals) return signals.error();
  if (is_session_directory(arguments.scene)) {
    if (!arguments.step_pictures.empty()) return invalid_argument("--step-pictures needs a scene");
    return run_maps(arguments, script, stop.get_token());
  }
  auto scene = config::load_scene(arguments.scene);
  if (!scene) return scene.error();
  const auto processors = static_cast<int>(std::max(1U, std::thread::hardware_concurrency()));
  ThreadTeam team(arguments.threads > 0 ? arguments.threads : processors);
  return Viewing(arguments, std::move(script)).run(*scene, team, stop.get_token());
}

int program(int argc, char** argv) {
  CLI::App app("A window on a scene: light it, paint into it, bend it.");
  Arguments arguments;
  app.add_option("SCENE",
                 arguments.scene,
                 "scene.toml (docs/rendering.md), or a session in a sphere of lights: its maps")
      ->required();
  app.add_option("--do", arguments.actions, "Does this, one thing a picture; may be given again");
  app.add_option("--frames", arguments.frames, "Ends after this many pictures")
      ->check(CLI::Range(0, 1'000'000));
  app.add_option("--screenshot", arguments.screenshot, "PNG of the window before it ends");
  app.add_option("--step-pictures",
                 arguments.step_pictures,
                 "Directory for a PNG of the window after each --do, named by number and verb")
      ->check(CLI::ExistingDirectory);
  app.add_option("--width", arguments.width, "Of the window, pixels")->check(CLI::Range(64, 8192));
  app.add_option("--height", arguments.height, "Of the window, pixels")
      ->check(CLI::Range(64, 8192));
  app.add_option("--device", arguments.device, "Part of the name of the Vulkan device");
  app.add_flag(
      "--validation", arguments.validation, "Vulkan's validation layer; what it says fails");
  app.add_option("--threads", arguments.threads, "0: one a processor")->check(CLI::Range(0, 1024));
  app.footer(
      "Left button: turn, or paint; right: move; wheel: nearer; Shift and left: turn the light.\n"
      "--do: orbit RIGHT UP | zoom F | pan R U | light N RIGHT UP | exposure STOPS | paint X Y | "
      "stroke X Y X Y |\n"
      "      brush NAME VALUE | undo | redo | save OBJECT FILE | bend OBJECT AMOUNT | tolerance T "
      "|\n"
      "      resize W H | minimise | restore | lose | wait FRAMES | screenshot FILE\n"
      "Exit status: 0 done, 1 failed, 2 bad scene, 3 stopped\n\nExamples:\n"
      "  opaline-view config/scene_marble_torus.toml\n"
      "  opaline-view scene.toml --do 'brush radius 2' --do 'paint 0.5 0.6' --do 'screenshot "
      "a.png'\n"
      "  opaline-view scene.toml --frames 5 --screenshot window.png\n"
      "  opaline-view SESSION --do 'light 0 90 0' --do 'orbit 30 0' --screenshot turned.png");
  return run_command(app, "opaline-view", argc, argv, [&] { return run(arguments); });
}

}  // namespace
}  // namespace opaline::daemon

int main(int argc, char** argv) {
  return opaline::daemon::run_program(argc, argv, opaline::daemon::program);
}
