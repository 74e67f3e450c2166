#include "daemon/preview/live_object.h"

#include <algorithm>
#include <filesystem>
#include <mutex>
#include <thread>
#include <utility>

#include "base/files.h"
#include "base/io/image_io.h"
#include "config/session_config.h"
#include "daemon/jobs/control_server.h"
#include "daemon/live_view.h"
#include "daemon/preview/object_scene.h"
#include "daemon/preview/object_wishes.h"
#include "daemon/preview/session_object.h"
#include "daemon/render/developed_picture.h"
#include "daemon/render/render_report.h"
#include "daemon/render/scene_view.h"

namespace opaline::daemon {
namespace {

constexpr std::chrono::milliseconds kPatience{100};  // between looks at the file and the watchers

class LiveObject {
 public:
  LiveObject(const SessionDirectory& session, const LiveObjectOptions& options, int threads)
      : session_(session), options_(options), team_(threads) {}

  Result<void> run(std::stop_token outer) {
    const std::stop_callback stopped(outer, [this] { stop_.request_stop(); });
    auto live = LiveView::create(system_files(), live_object_directory(session_));
    if (!live) return live.error();
    live_ = *std::move(live);
    auto wishes = ObjectWishes::create(system_files(), object_scene_file(session_));
    if (!wishes) return wishes.error();
    wishes_ = *std::move(wishes);
    const auto control = ControlServer::start(live_->directory() / "control.sock",
                                              [this](const auto& r) { return answer(r); });
    if (!control) return control.error();
    while (!stop_.stop_requested() && is_watched()) {
      const std::stop_token another_wish = watch_for_wishes();
      const auto batch = wishes_->take(kPatience, stop_.get_token());
      if (!batch && is_settled_) continue;
      auto shown = batch ? show(*batch) : draw(render::Pace::kAtRest, another_wish);
      if (!batch && another_wish.stop_requested()) {
        is_settled_ = false;
        continue;
      }
      const bool is_over = !shown && (stop_.stop_requested() || number_ == 0);
      if (is_over) return stop_.stop_requested() ? ok() : shown;
      if (!shown) figures_["message"] = shown.error().message;
      if (auto told = tell(); !told) return told;
    }
    return ok();
  }

 private:
  bool is_watched() const {
    return options_.while_watched.count() == 0 || live_->is_watched(options_.while_watched);
  }

  /// Stopped by the next request.
  std::stop_token watch_for_wishes() {
    const std::lock_guard lock(settling_mutex_);
    settling_ = std::stop_source();
    return settling_.get_token();
  }

  nlohmann::json answer(const nlohmann::json& request) {
    nlohmann::json answered = answered_to(request);
    const std::lock_guard lock(settling_mutex_);
    settling_.request_stop();
    return answered;
  }

  nlohmann::json answered_to(const nlohmann::json& request) {
    const auto it = request.find("command");
    const bool is_word = it != request.end() && it->is_string();
    if (is_word && *it == "cancel") {
      stop_.request_stop();
      return {{"ok", true}};
    }
    if (is_word && *it == "status") return {{"ok", true}, {"job", "object"}};
    return wishes_->answer(request);
  }

  Result<void> show(const ObjectWishes::Batch& batch) {
    figures_["message"] = batch.message;
    if (!batch.is_changed) return ok();
    if (batch.is_new_scene) {
      if (auto made = make_ready(batch); !made) return made;
    } else {
      for (const ObjectWishes::Step& step : batch.steps) {
        if (auto done = perform(step); !done) return done;
      }
    }
    scene_ = batch.scene;
    figures_["edits"] = batch.scene.objects.back().edits.size();
    figures_["can_undo"] = batch.undoable > 0;
    figures_["can_redo"] = batch.redoable > 0;
    const bool is_moving = number_ > 0 && !batch.is_new_scene;
    return draw(is_moving ? render::Pace::kMoving : render::Pace::kAtRest, stop_.get_token());
  }

  Result<void> draw(render::Pace pace, const std::stop_token& stop) {
    is_settled_ = true;  // also where it fails: that is told once
    const auto radiance = view_->picture(scene_.lights, scene_.camera, pace, stop);
    if (!radiance) return radiance.error();
    if (!(white_ > 0.0)) white_ = white_of(*radiance, scene_.picture);
    auto png = developed(*radiance, white_, scene_.picture, ImageFormat::kPng);
    if (!png) return png.error();
    png_ = *std::move(png);
    ++number_;
    is_settled_ = !view_->renderer().is_provisional();
    describe();
    return ok();
  }

  /// The scene's edits are in it from the start, so the steps that came with it are done.
  Result<void> make_ready(const ObjectWishes::Batch& batch) {
    auto view = SceneView::create(
        batch.scene,
        DrawBy::kAuto,
        options_.gpu,
        team_,
        [](std::string_view, double) {},
        stop_.get_token());
    if (!view) return view.error();
    view_ = *std::move(view);
    return ok();
  }

  Result<void> perform(const ObjectWishes::Step& step) {
    using Kind = ObjectWishes::Step::Kind;
    render::TranslucentBody* body =
        view_->renderer().body(view_->scene().objects.size() - 1);  // it has edits, so it is one
    if (step.kind == Kind::kEdit) {
      const auto cells = body->edit({step.stroke});
      return cells ? ok() : Result<void>(cells.error());
    }
    const auto done = step.kind == Kind::kUndo ? body->undo() : body->redo();
    return done ? ok() : Result<void>(done.error());
  }

  void describe() {
    const render::SceneStatistics& s = view_->renderer().statistics();
    const auto& last = s.objects.back();
    figures_["by"] = "object";
    figures_["settled"] = is_settled_;
    figures_["seconds"] = to_json(s)["seconds"];
    figures_["iterations"] = last.iterations;
    figures_["relative_residual"] = last.relative_residual;
    figures_["drawn_by"] = view_->description();
    figures_["white"] = white_;
  }

  Result<void> tell() { return live_->show(png_, figures_); }

  const SessionDirectory& session_;
  const LiveObjectOptions& options_;
  ThreadTeam team_;
  std::stop_source stop_;
  std::unique_ptr<LiveView> live_;
  std::unique_ptr<ObjectWishes> wishes_;
  std::unique_ptr<SceneView> view_;
  std::vector<std::byte> png_;
  nlohmann::json figures_ = nlohmann::json::object();
  double white_ = 0.0;
  render::Scene scene_;  // of the last batch
  int number_ = 0;
  bool is_settled_ = true;
  std::mutex settling_mutex_;
  std::stop_source settling_;  // guarded by settling_mutex_; a request stops it
};

}  // namespace

std::filesystem::path live_object_directory(const SessionDirectory& session) {
  return session.preview() / "live";
}

Result<void> show_object(const SessionDirectory& session,
                         const LiveObjectOptions& options,
                         std::stop_token stop) {
  const auto config = config::load_resolved(session);
  if (!config) return config.error();
  if (config->kind == config::SessionKind::kLedSphere)
    return invalid_argument(
        "this session measured an object among lamps, not a block: \"opaline view scene.toml\" "
        "in its directory shows and edits that object");
  if (auto written = write_object_scene(system_files(), session, *config); !written) return written;
  const auto processors = static_cast<int>(std::max(1U, std::thread::hardware_concurrency()));
  return LiveObject(session, options, options.threads > 0 ? options.threads : processors)
      .run(std::move(stop));
}

}  // namespace opaline::daemon
