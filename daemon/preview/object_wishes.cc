#include "daemon/preview/object_wishes.h"

#include <fmt/format.h>

#include <optional>
#include <utility>

#include "config/scene_config.h"
#include "daemon/jobs/control_server.h"
#include "daemon/preview/json_numbers.h"
#include "daemon/preview/stroke_text.h"

namespace opaline::daemon {
namespace {

constexpr std::size_t kLargestScene = 4u << 20;

Result<Vec3> three(const nlohmann::json& request, const char* key) {
  const auto it = request.find(key);
  if (it == request.end() || !is_three_numbers(*it))
    return invalid_argument(fmt::format("\"{}\": expected three numbers", key));
  return Vec3{(*it)[0].get<double>(), (*it)[1].get<double>(), (*it)[2].get<double>()};
}

}  // namespace

Result<std::unique_ptr<ObjectWishes>> ObjectWishes::create(FileOperations& files,
                                                           std::filesystem::path file) {
  std::unique_ptr<ObjectWishes> wishes(new ObjectWishes(files, std::move(file)));
  const std::lock_guard lock(wishes->mutex_);
  if (auto read = wishes->read_file(); !read) return read.error();
  return wishes;
}

Result<render::Scene> ObjectWishes::parsed(const std::string& text) const {
  return config::parse_scene({file_.string(), text, file_.parent_path()});
}

/// Takes what somebody else has written.
Result<void> ObjectWishes::read_file() {
  const auto text = read_text(file_, kLargestScene);
  if (!text) return text.error();
  if (*text == text_ || *text == refused_) return ok();
  auto scene = parsed(*text);
  if (!scene) {
    refused_ = *text;
    return scene.error();
  }
  text_ = *text;
  refused_.clear();
  done_.clear();
  undone_.clear();
  next_ = {.is_new_scene = true, .steps = {}, .scene = *std::move(scene), .message = {}};
  is_wished_ = true;
  return ok();
}

/// Writes the scene, which parses.
Result<void> ObjectWishes::become(const std::string& text) {
  if (auto written = write_whole(files_, file_, text); !written) return written;
  text_ = text;
  return ok();
}

Result<void> ObjectWishes::edit(const nlohmann::json& stroke) {
  const auto written = stroke_text(stroke);
  if (!written) return written.error();
  const std::string text = text_ + *written;
  auto scene = parsed(text);
  if (!scene) return scene.error();
  if (auto done = become(text); !done) return done;
  done_.push_back(*written);
  undone_.clear();
  next_.scene.objects.back().edits = scene->objects.back().edits;
  next_.steps.push_back({Step::Kind::kEdit, scene->objects.back().edits.back()});
  return ok();
}

Result<void> ObjectWishes::undo() {
  if (done_.empty()) return busy("there is no stroke to take back");
  if (auto done = become(text_.substr(0, text_.size() - done_.back().size())); !done) return done;
  undone_.push_back(std::move(done_.back()));
  done_.pop_back();
  next_.scene.objects.back().edits.pop_back();
  next_.steps.push_back({Step::Kind::kUndo});
  return ok();
}

Result<void> ObjectWishes::redo() {
  if (undone_.empty()) return busy("there is no stroke to do again");
  const std::string text = text_ + undone_.back();
  auto scene = parsed(text);
  if (!scene) return scene.error();
  if (auto done = become(text); !done) return done;
  done_.push_back(std::move(undone_.back()));
  undone_.pop_back();
  next_.scene.objects.back().edits = scene->objects.back().edits;
  next_.steps.push_back({Step::Kind::kRedo});
  return ok();
}

Result<void> ObjectWishes::look(const nlohmann::json& request) {
  const auto position = three(request, "position_mm");
  if (!position) return position.error();
  const auto target = three(request, "target_mm");
  if (!target) return target.error();
  render::Scene scene = next_.scene;
  scene.camera.position = *position;
  scene.camera.target = *target;
  if (auto valid = validate(scene); !valid) return valid;
  next_.scene = std::move(scene);
  return ok();
}

Result<void> ObjectWishes::shine(const nlohmann::json& request) {
  const auto direction = three(request, "direction");
  if (!direction) return direction.error();
  const auto light = request.find("light");
  const std::size_t count = next_.scene.lights.size();
  if (light == request.end() || !light->is_number_unsigned() || light->get<std::size_t>() >= count)
    return invalid_argument(
        fmt::format("\"light\": expected one of the scene's {}, counted from 0", count));
  render::Scene scene = next_.scene;
  scene.lights[light->get<std::size_t>()].direction = *direction;
  if (auto valid = validate(scene); !valid) return valid;
  next_.scene = std::move(scene);
  return ok();
}

Result<void> ObjectWishes::perform(const std::string& command, const nlohmann::json& request) {
  if (auto read = read_file(); !read) return read;
  if (command == "edit") return edit(request.value("stroke", nlohmann::json()));
  if (command == "undo") return undo();
  if (command == "redo") return redo();
  if (command == "look") return look(request);
  if (command == "shine") return shine(request);
  return invalid_argument(fmt::format(
      "command \"{}\"; known are edit, undo, redo, look, shine, cancel, status", command));
}

nlohmann::json ObjectWishes::answer(const nlohmann::json& request) {
  const auto it = request.find("command");
  const std::string command =
      it != request.end() && it->is_string() ? it->get<std::string>() : std::string();
  const std::lock_guard lock(mutex_);
  if (auto done = perform(command, request); !done) return control_error(done.error());
  is_wished_ = true;
  wished_.notify_one();
  return {{"ok", true}, {"can_undo", !done_.empty()}, {"can_redo", !undone_.empty()}};
}

std::optional<ObjectWishes::Batch> ObjectWishes::take(std::chrono::milliseconds patience,
                                                      const std::stop_token& stop) {
  std::unique_lock lock(mutex_);
  wished_.wait_for(lock, stop, patience, [this] { return is_wished_; });
  const auto read = read_file();
  if (read && !is_wished_) return std::nullopt;
  Batch batch = next_;
  batch.is_changed = is_wished_;
  is_wished_ = false;
  if (!read) batch.message = read.error().message;
  batch.undoable = done_.size();
  batch.redoable = undone_.size();
  next_.steps.clear();
  next_.is_new_scene = false;
  return batch;
}

}  // namespace opaline::daemon
