#include "calibration/frame_taker.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <utility>

#include "base/log.h"
#include "base/seconds.h"

namespace opaline::calibration {
namespace {

using std::chrono::nanoseconds;

constexpr int kTries = 4;
constexpr int kSettlePeriods = 2;
constexpr nanoseconds kApart = std::chrono::microseconds(5);

bool can_retry(ErrorCode code) {
  return code == ErrorCode::kUnavailable || code == ErrorCode::kTimeout || code == ErrorCode::kBusy;
}

}  // namespace

Result<std::unique_ptr<FrameTaker>> FrameTaker::create(const capture::Station& station,
                                                       EventSink& events) {
  std::unique_ptr<FrameTaker> taker(new FrameTaker(station, events));
  if (auto opened = taker->open(); !opened) return opened.error();
  if (taker->most_turns() < taker->least_turns()) {
    return invalid_argument(
        fmt::format("no whole turn of the colour wheel ({:.4g} s) lies between the camera's "
                    "exposures of {:.4g} and {:.4g} s",
                    seconds(taker->turn()),
                    seconds(taker->camera_.shortest_exposure),
                    seconds(taker->camera_.longest_exposure)));
  }
  return taker;
}

FrameTaker::~FrameTaker() {
  if (auto dark = station_.projector.dark(); !dark)
    log::warning("the lamp may still be on: {}", dark.error().message);
  station_.camera.close();
  station_.projector.close();
}

Result<void> FrameTaker::open() {
  station_.camera.close();
  station_.projector.close();
  if (auto opened = station_.projector.open(); !opened) return opened.error().in("projector");
  if (auto opened = station_.camera.open(); !opened) return opened.error().in("camera");
  auto projector = station_.projector.info();
  if (!projector) return projector.error().in("projector");
  auto camera = station_.camera.info();
  if (!camera) return camera.error().in("camera");
  projector_ = *std::move(projector);
  camera_ = *std::move(camera);
  check_.emplace(camera_);
  return ok();
}

nanoseconds FrameTaker::turn() const {
  return projector_.frame_period.count() > 0 ? projector_.frame_period : camera_.shortest_exposure;
}

int FrameTaker::least_turns() const {
  const double turns = seconds(camera_.shortest_exposure) / seconds(turn());
  return std::max(1, static_cast<int>(std::ceil(turns - 1e-6)));
}

int FrameTaker::most_turns() const {
  const double turns = seconds(camera_.longest_exposure) / seconds(turn());
  return static_cast<int>(std::min(std::floor(turns + 1e-6), 1e6));
}

Result<void> FrameTaker::pause(nanoseconds time, std::stop_token stop) const {
  if (station_.clock.sleep(time, std::move(stop))) return ok();
  return cancelled("stopped");
}

Result<Frame> FrameTaker::checked(std::uint64_t pattern,
                                  std::string name,
                                  nanoseconds exposure,
                                  const std::stop_token& stop) {
  auto frame = station_.camera.capture({exposure, pattern, std::move(name)}, stop);
  if (!frame) {
    check_->forget();
    return frame;
  }
  if (const auto problem = check_->check(*frame, pattern, exposure)) {
    return unavailable(
        fmt::format("{} frame: {}", capture::to_string(problem->fault), problem->message));
  }
  if (watcher_) watcher_(*frame);
  return frame;
}

Result<Frame> FrameTaker::attempt_lit(const Image<std::uint8_t>& codes,
                                      const std::string& name,
                                      nanoseconds exposure,
                                      const std::stop_token& stop) {
  const drivers::Pattern pattern{++next_pattern_, codes, name};
  if (auto shown = station_.projector.show(pattern, stop); !shown)
    return shown.error().in("projector");
  const nanoseconds settle = projector_.latency + projector_.frame_period * kSettlePeriods;
  if (auto waited = pause(settle, stop); !waited) return waited.error();
  return checked(pattern.id, name, exposure, stop);
}

Result<Frame> FrameTaker::attempt_dark(nanoseconds exposure, const std::stop_token& stop) {
  if (auto dark = station_.projector.dark(); !dark) return dark.error().in("projector");
  if (auto waited = pause(projector_.latency, stop); !waited) return waited.error();
  return checked(0, "dark", exposure + kApart * ++dark_frames_, stop);
}

Result<Frame> FrameTaker::retried(const std::string& name,
                                  const std::function<Result<Frame>()>& attempt,
                                  const std::stop_token& stop) {
  for (int tries = 1;; ++tries) {
    auto frame = attempt();
    if (frame) return frame;
    if (stop.stop_requested()) return cancelled(fmt::format("{}: stopped", name));
    if (!can_retry(frame.error().code)) return frame.error().in(name);
    if (tries == kTries) return frame.error().in(fmt::format("{}, taken {} times", name, tries));
    auto noted = events_.fact("frame.retaken",
                              {{"message", fmt::format("{}: {}", name, frame.error().message)}});
    if (!noted) return noted.error();
    if (auto opened = open(); !opened && !can_retry(opened.error().code)) return opened.error();
  }
}

Result<Frame> FrameTaker::lit(const FlatLight& light, int turns, std::stop_token stop) {
  const nanoseconds exposure = turn() * turns;
  Image<std::uint8_t> codes(projector_.width, projector_.height, 3);
  for (std::size_t i = 0; i < codes.samples().size(); ++i) codes.samples()[i] = light[i % 3];
  const std::string name = fmt::format("flat_{}_{}_{}", light[0], light[1], light[2]);
  return retried(
      fmt::format("light {} {} {} for {:.4g} s", light[0], light[1], light[2], seconds(exposure)),
      [&] { return attempt_lit(codes, name, exposure, stop); },
      stop);
}

Result<Frame> FrameTaker::pictured(const Image<std::uint8_t>& grey,
                                   const std::string& name,
                                   int turns,
                                   std::stop_token stop) {
  const nanoseconds exposure = turn() * turns;
  Image<std::uint8_t> codes(grey.width(), grey.height(), 3);
  for (std::size_t i = 0; i < codes.samples().size(); ++i)
    codes.samples()[i] = grey.samples()[i / 3];
  return retried(
      fmt::format("{} for {:.4g} s", name, seconds(exposure)),
      [&] { return attempt_lit(codes, name, exposure, stop); },
      stop);
}

Result<void> FrameTaker::rest(nanoseconds time, std::stop_token stop) {
  if (auto dark = station_.projector.dark(); !dark) return dark.error().in("projector");
  return pause(time, std::move(stop));
}

Result<Frame> FrameTaker::dark(nanoseconds exposure, std::stop_token stop) {
  return retried(
      fmt::format("dark for {:.4g} s", seconds(exposure)),
      [&] { return attempt_dark(exposure, stop); },
      stop);
}

}  // namespace opaline::calibration
