#include "daemon/calibrate/live_attendant.h"

#include <fmt/format.h>
#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <utility>

#include "base/io/image_io.h"
#include "base/log.h"
#include "daemon/calibrate/pose_picture.h"
#include "daemon/calibrate/view_frame.h"

namespace opaline::daemon {
namespace {

using calibration::PoseAnswer;
using calibration::PoseSight;
using SteadyClock = std::chrono::steady_clock;

constexpr std::chrono::milliseconds kBetweenShown{500};
constexpr std::chrono::milliseconds kBoardShown{3000};  // its picture is the one to look at
constexpr std::size_t kMostTyped = 256;

nlohmann::json tilts_of(const calibration::PoseGuide& guide) {
  return {{"left", guide.left_nearer},
          {"right", guide.right_nearer},
          {"top", guide.top_nearer},
          {"bottom", guide.bottom_nearer},
          {"flat", guide.flat}};
}

}  // namespace

PoseAnswer LiveAttendant::answer() {
  std::string said = typed();
  if (said.empty() && options_.live != nullptr) said = options_.live->take_answer();
  if (said.empty()) return PoseAnswer::kNone;
  return said.find("enough") != std::string::npos ? PoseAnswer::kEnough : PoseAnswer::kTake;
}

// What has been typed, its newline included; nothing once there is no more to come.
std::string LiveAttendant::typed() {
  pollfd keys{STDIN_FILENO, POLLIN, 0};
  if (!keyboard_ || ::poll(&keys, 1, 0) <= 0) return {};
  std::array<char, kMostTyped> buffer{};
  const ssize_t got = ::read(STDIN_FILENO, buffer.data(), buffer.size());
  keyboard_ = got > 0;
  return got > 0 ? std::string(buffer.data(), static_cast<std::size_t>(got)) : std::string();
}

bool LiveAttendant::is_due() {
  if (options_.live == nullptr) return false;
  const auto now = SteadyClock::now();
  if (shown_ && now - *shown_ < (waiting_ ? kBoardShown : kBetweenShown)) return false;
  shown_ = now;
  return true;
}

void LiveAttendant::doing(const std::string& step, const std::string& detail) {
  const std::lock_guard lock(mutex_);
  step_ = step;
  detail_ = detail;
}

nlohmann::json LiveAttendant::figures() const {
  const std::lock_guard lock(mutex_);
  return {
      {"by", "calibration"}, {"version", options_.version}, {"step", step_}, {"doing", detail_}};
}

void LiveAttendant::saw(const Frame& frame) {
  if (!is_due()) return;
  auto view = view_of(frame, options_.black, options_.clipping);
  if (!view) return complain(view.error());
  best_focus_ = std::max(best_focus_, view->figures.focus);
  nlohmann::json json = figures();
  json.update(view->json);
  json["best_focus"] = best_focus_;
  show(view->png, std::move(json));
}

void LiveAttendant::saw(const PoseSight& sight) {
  const auto png = encode_image(
      {pose_picture(sight.grey, sight.board, sight.guide, kWidestView), {}, {}}, ImageFormat::kPng);
  if (!png) return complain(png.error());
  if (sight.taken && !options_.poses.empty()) {
    if (std::exchange(poses_are_old_, false)) {
      std::error_code none;
      std::filesystem::remove_all(options_.poses, none);
    }
    auto written = files_.make_directories(options_.poses);
    if (written)
      written =
          write_whole(files_, options_.poses / fmt::format("pose_{:02}.png", sight.pose), *png);
    if (!written) complain(written.error());
  }
  if (options_.live == nullptr) return;
  nlohmann::json json = figures();
  json["doing"] = sight.doing;
  json["board"] = {{"pose", sight.pose},
                   {"poses", sight.poses},
                   {"taken", sight.taken},
                   {"corners", sight.board.corners.size()},
                   {"fault", sight.board.fault},
                   {"blur_px", sight.board.blur_px},
                   {"fields", sight.guide.fields},
                   {"coverage", sight.guide.coverage},
                   {"tilts", tilts_of(sight.guide)},
                   {"next", sight.guide.wish}};
  show(*png, std::move(json));
  shown_ = SteadyClock::now();
  waiting_ = !sight.taken;
}

void LiveAttendant::show(std::span<const std::byte> png, nlohmann::json figures) {
  if (auto shown = options_.live->show(png, std::move(figures)); !shown) complain(shown.error());
}

void LiveAttendant::complain(const Error& error) {
  if (!complained_) log::warning("the live view: {}", error.message);
  complained_ = true;
}

}  // namespace opaline::daemon
