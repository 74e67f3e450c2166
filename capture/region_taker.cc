#include "capture/region_taker.h"

#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <utility>

#include "base/log.h"
#include "base/seconds.h"

namespace opaline::capture {
namespace {

using std::chrono::nanoseconds;

constexpr nanoseconds kReplugPatience = std::chrono::seconds(10);
constexpr nanoseconds kReplugPause = std::chrono::milliseconds(200);

double middle_of(const Frame& frame) {
  return seconds(frame.start) + 0.5 * seconds(frame.exposure);
}

bool can_retry(ErrorCode code) {
  return code == ErrorCode::kUnavailable || code == ErrorCode::kTimeout || code == ErrorCode::kBusy;
}

}  // namespace

std::optional<std::size_t> find_black_frame(std::span<const FrameLight> lights,
                                            std::span<const double> times) {
  // The dimmest lit frame's rate is the least that all others must show.
  std::optional<double> rate;
  for (std::size_t i = 0; i < lights.size(); ++i) {
    if (!lights[i].stands_out()) continue;
    const double own = lights[i].mean_electrons / times[i];
    rate = rate ? std::min(*rate, own) : own;
  }
  if (!rate) return std::nullopt;
  for (std::size_t i = 0; i < lights.size(); ++i) {
    const double expected = *rate * times[i];
    const bool provable = lights[i].tells() && expected > 20.0 * lights[i].mean_deviation;
    if (provable && lights[i].mean_electrons < 0.2 * expected) return i;
  }
  return std::nullopt;
}

RegionTaker::RegionTaker(const Station& station, const Settings& settings, EventSink& events)
    : station_(station), settings_(settings), events_(events), steadiness_(settings.camera) {}

RegionTaker::~RegionTaker() {
  if (auto dark = station_.projector.dark(); !dark) {
    log::warning("the lamp may still be on: {}", dark.error().message);
  }
  station_.camera.close();
  station_.projector.close();
}

Result<std::unique_ptr<RegionTaker>> RegionTaker::create(const Station& station,
                                                         const Settings& settings,
                                                         EventSink& events) {
  std::unique_ptr<RegionTaker> taker(new RegionTaker(station, settings, events));
  if (auto opened = taker->open_devices(); !opened) return opened.error();
  auto ladder = exposure_ladder(settings.options.exposures,
                                {taker->projector_.frame_period,
                                 taker->camera_.shortest_exposure,
                                 taker->camera_.longest_exposure});
  if (!ladder) return ladder.error();
  taker->ladder_ = *std::move(ladder);
  for (const nanoseconds exposure : taker->ladder_) taker->whole_ladder_ += exposure;
  return taker;
}

Result<void> RegionTaker::open_devices() {
  if (auto opened = station_.projector.open(); !opened) return opened.error().in("projector");
  if (auto opened = station_.camera.open(); !opened) return opened.error().in("camera");
  auto projector = station_.projector.info();
  if (!projector) return projector.error().in("projector");
  auto camera = station_.camera.info();
  if (!camera) return camera.error().in("camera");
  projector_ = *std::move(projector);
  camera_ = *std::move(camera);
  check_.emplace(camera_);
  return check_sizes();
}

// What is plugged in again may be something else.
Result<void> RegionTaker::check_sizes() const {
  const CameraModel& model = settings_.camera.model;
  if (camera_.width != model.width || camera_.height != model.height ||
      camera_.bit_depth != settings_.camera.bit_depth) {
    return invalid_argument(
        fmt::format("the camera has {} x {} pixels of {} bits, its calibration {} x {} of {}",
                    camera_.width,
                    camera_.height,
                    camera_.bit_depth,
                    model.width,
                    model.height,
                    settings_.camera.bit_depth));
  }
  return ok();
}

std::size_t RegionTaker::frame_bytes() const {
  return static_cast<std::size_t>(camera_.width) * camera_.height * 3 * sizeof(std::uint16_t);
}

Result<void> RegionTaker::recover(std::stop_token stop) {
  const nanoseconds deadline = station_.clock.now() + kReplugPatience;
  for (;;) {
    station_.camera.close();
    station_.projector.close();
    if (!station_.clock.sleep(kReplugPause, stop)) return cancelled("while devices were away");
    auto opened = open_devices();
    const bool other = !opened && opened.error().code == ErrorCode::kInvalidArgument;
    if (opened || other || station_.clock.now() >= deadline) return opened;
  }
}

Result<TakenLight> RegionTaker::with_retries(const std::string& name,
                                             const AttemptFunction& attempt,
                                             std::stop_token stop) {
  steadiness_.next_light();
  for (int tries = 0;; ++tries) {
    Attempt taken = attempt();
    if (taken && taken->unsteady) {
      if (auto noted = note_unsteady(name, tries + 1, *taken->unsteady); !noted)
        return noted.error();
    }
    const bool good = taken && taken->lit && !taken->unsteady;
    if (good || (taken && tries == settings_.options.retries)) {
      taken->retaken = tries;
      return *std::move(taken);
    }
    const Failure failure = !taken ? taken.error()
                            : taken->unsteady
                                ? Failure{unavailable(taken->unsteady->message),
                                          std::string(to_string(taken->unsteady->kind))}
                                : Failure{unavailable("no light in any exposure"), "black"};
    if (stop.stop_requested()) return cancelled(fmt::format("{}: stopped", name));
    if (!can_retry(failure.error.code)) return failure.error.in(name);
    if (tries >= settings_.options.retries) {
      return failure.error.in(fmt::format("{}, taken {} times", name, tries + 1));
    }
    log::warning("{}: {}; taken again ({} of {})",
                 name,
                 failure.error.message,
                 tries + 1,
                 settings_.options.retries);
    const auto noted = events_.fact("region.retaken",
                                    {{"region", name},
                                     {"attempt", tries + 1},
                                     {"fault", failure.fault},
                                     {"message", failure.error.message}});
    if (!noted) return noted.error();
    if (failure.fault != "device") continue;
    if (auto back = recover(stop); !back) {
      if (back.error().code == ErrorCode::kInvalidArgument) return back.error().in(name);
      log::warning("{}: {}", name, back.error().message);
    }
  }
}

Result<void> RegionTaker::check_place(const std::string& name,
                                      const TakenLight& taken,
                                      const BlackFrames& black) const {
  const auto now = std::ranges::find(
      taken.frames, before_motion_->exposure_index, &CapturedFrame::exposure_index);
  if (now == taken.frames.end()) return ok();
  const auto first = black.pair(*before_motion_);
  const auto second = black.pair(*now);
  if (!first || !second) return ok();
  const std::size_t index = now->exposure_index;
  const auto moved = steadiness_.moved({*first, index, middle_of(before_motion_->frame)},
                                       {*second, index, middle_of(now->frame)},
                                       black.footprint());
  if (!moved) return ok();
  const std::string message = fmt::format(
      "{}: what the camera sees has moved and stays there ({:.2g} % of the light, {:.2g} px): "
      "lights "
      "before do not go with those to come. Put it back and start again, or start a new session",
      name,
      100.0 * moved->size,
      moved->shift_px);
  const auto noted = events_.fact("sample.moved",
                                  {{"region", name},
                                   {"size", moved->size},
                                   {"shift_px", moved->shift_px},
                                   {"message", message}});
  return noted ? Result<void>(unavailable(message)) : noted;
}

Result<void> RegionTaker::note_unsteady(const std::string& name,
                                        int attempt,
                                        const UnsteadyLight& unsteady) {
  nlohmann::json fact{{"region", name},
                      {"attempt", attempt},
                      {"kind", to_string(unsteady.kind)},
                      {"size", unsteady.size},
                      {"deviation", unsteady.deviation},
                      {"message", fmt::format("{}: {}", name, unsteady.message)}};
  if (unsteady.shift_px > 0.0) fact["shift_px"] = unsteady.shift_px;
  if (unsteady.where) {
    fact["x"] = unsteady.where->first;
    fact["y"] = unsteady.where->second;
  }
  return events_.fact("region.unsteady", fact);
}

std::optional<RegionTaker::Failure> RegionTaker::show(const drivers::Pattern& pattern,
                                                      std::stop_token stop) {
  if (auto shown = station_.projector.show(pattern, stop); !shown) {
    return Failure{shown.error().in("projector"), "device"};
  }
  const nanoseconds settle =
      projector_.latency + projector_.frame_period * settings_.options.settle_periods;
  if (!station_.clock.sleep(settle, stop)) return Failure{cancelled("while settling"), "stop"};
  return std::nullopt;
}

RegionTaker::CaptureResult RegionTaker::capture(const drivers::Pattern& pattern,
                                                std::size_t index,
                                                std::size_t repeat,
                                                const Watcher& watcher,
                                                std::stop_token stop) {
  const nanoseconds exposure = repeated_exposure(ladder_[index], repeat);
  if (watcher) watcher(exposure);
  const std::string where = fmt::format("exposure of {:.4g} s", seconds(exposure));
  auto frame = station_.camera.capture({exposure, pattern.id, pattern.name}, stop);
  if (!frame) {
    check_->forget();
    return tl::unexpected(Failure{frame.error().in(where), "device"});
  }
  if (const auto problem = check_->check(*frame, pattern.id, exposure)) {
    return tl::unexpected(
        Failure{unavailable(fmt::format(
                    "{}: {} frame: {}", where, to_string(problem->fault), problem->message)),
                std::string(to_string(problem->fault))});
  }
  return CapturedFrame{index, exposure, *std::move(frame)};
}

RegionTaker::Attempt RegionTaker::attempt_black(const drivers::Pattern& black,
                                                bool repeated,
                                                const Watcher& watcher,
                                                std::stop_token stop) {
  if (auto failure = show(black, stop)) return tl::unexpected(*std::move(failure));
  TakenLight taken{{}, true, 0};
  const bool planned = settings_.options.exposures.mode == ExposureMode::kPlanned;
  for (std::size_t i = 0; i < ladder_.size(); ++i) {
    const int times = planned && repeated ? planned_blacks(ladder_[i], ladder_.size()) : 1;
    for (int repeat = 0; repeat < times; ++repeat) {
      auto frame = capture(black, i, static_cast<std::size_t>(repeat), watcher, stop);
      if (!frame) return tl::unexpected(std::move(frame.error()));
      taken.frames.push_back(*std::move(frame));
    }
    if (planned && leak_dominates(settings_.camera, taken.frames.back().frame.pixels)) {
      ladder_.resize(i + 1);
    }
  }
  return taken;
}

RegionTaker::Attempt RegionTaker::attempt_light(const drivers::Pattern& pattern,
                                                const BlackFrames& black,
                                                const Watcher& watcher,
                                                std::stop_token stop,
                                                const ChooseExposures& choose) {
  if (auto failure = show(pattern, stop)) return tl::unexpected(*std::move(failure));
  TakenLight taken;
  taken.frames.reserve(kMaxExposures);  // pairs point into it
  std::vector<FrameLight> lights;
  std::vector<double> times;
  std::vector<TimedExposure> exposures;
  const std::unique_ptr<ExposureChooser> chooser =
      choose ? choose()
             : std::make_unique<BracketChooser>(settings_.options.exposures, ladder_.size());
  while (taken.frames.size() < kMaxExposures) {
    const auto index = chooser->next();
    if (!index) break;
    const auto repeat = std::ranges::count(taken.frames, *index, &CapturedFrame::exposure_index);
    auto frame = capture(pattern, *index, static_cast<std::size_t>(repeat), watcher, stop);
    if (!frame) return tl::unexpected(std::move(frame.error()));
    taken.frames.push_back(*std::move(frame));
    const auto pair = black.pair(taken.frames.back());
    if (!pair) {
      return tl::unexpected(Failure{internal_error("no black frame for this exposure"), "black"});
    }
    lights.push_back(measure_light(
        settings_.camera, *pair, black.footprint(), settings_.options.exposures.dark_quantile));
    times.push_back(pair->light_seconds);
    exposures.push_back({*pair, *index, middle_of(taken.frames.back().frame)});
    chooser->add(*index, *pair, lights.back());
    taken.lit = taken.lit || lights.back().lit();
  }
  if (const auto dark = find_black_frame(lights, times)) {
    const double asked = seconds(taken.frames[*dark].exposure_asked);
    return tl::unexpected(
        Failure{unavailable(fmt::format(
                    "exposure of {:.4g} s: black frame: other exposures show light", asked)),
                std::string(to_string(FrameFault::kBlack))});
  }
  if (taken.lit) {
    auto verdict = steadiness_.judge(exposures, black.footprint());
    taken.unsteady = std::move(verdict.unsteady);
    const bool motion = taken.unsteady && taken.unsteady->kind == Unsteadiness::kMotion;
    if (motion && !before_motion_) before_motion_ = taken.frames.front();
    if (!verdict.disagreement.empty()) {
      log::warning("{}", verdict.disagreement);
      const auto noted = events_.fact("calibration.warning", {{"message", verdict.disagreement}});
      if (!noted) return tl::unexpected(Failure{noted.error(), "events"});
    }
  }
  std::ranges::stable_sort(taken.frames, {}, &CapturedFrame::exposure_index);
  return taken;
}

Result<TakenLight> RegionTaker::take_black(const drivers::Pattern& black,
                                           bool repeated,
                                           const Watcher& watcher,
                                           std::stop_token stop) {
  return with_retries(
      "black", [&] { return attempt_black(black, repeated, watcher, stop); }, stop);
}

void RegionTaker::use_black(const BlackFrames& black) {
  if (settings_.options.exposures.mode != ExposureMode::kPlanned) return;
  const std::size_t useful = black.useful(ladder_, settings_.camera);
  if (black.cover(std::span(ladder_).first(useful))) ladder_.resize(useful);
}

Result<TakenLight> RegionTaker::take_light(const std::string& name,
                                           const drivers::Pattern& pattern,
                                           const BlackFrames& black,
                                           const Watcher& watcher,
                                           std::stop_token stop,
                                           const ChooseExposures& choose) {
  before_motion_.reset();
  auto taken = with_retries(
      name, [&] { return attempt_light(pattern, black, watcher, stop, choose); }, stop);
  if (!taken || !before_motion_ || taken->unsteady) return taken;
  if (auto place = check_place(name, *taken, black); !place) return place.error();
  return taken;
}

}  // namespace opaline::capture
