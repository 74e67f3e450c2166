// How the rig takes a picture: sim/rig.h.

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

#include "base/log.h"
#include "base/seconds.h"
#include "sim/rig.h"

namespace opaline::sim {
namespace {

using std::chrono::nanoseconds;

/// An exposure whose caller has gone away may still be on its way out when the next one is asked for.
constexpr std::chrono::milliseconds kExposureEnds{500};
constexpr nanoseconds kLong = std::chrono::seconds(1);
constexpr double kFlickers = 0.03;
constexpr double kFastTurn = 0.9;
constexpr std::uint16_t kDriftedCodes = 24;
constexpr double kMovedPx = 1.5;
constexpr double kFades = 0.02;
constexpr double kShadowLeaves = 0.8;  // of the light,
constexpr double kShadowFrom = 0.45;   // in the middle of the picture, of its width and height,
constexpr double kShadowTo = 0.75;     // up to here

/// For how long each channel is lit at full power by a wheel of which a turn takes `turn` seconds.
Rgb lit_seconds(const ProjectorOptics& projector,
                double turn,
                double phase,
                const LightStretch& stretch) {
  const double all = stretch.to_seconds - stretch.from_seconds;
  if (!projector.color_wheel) return {all, all, all};
  return wheel_lit_seconds(turn, phase + stretch.from_seconds, phase + stretch.to_seconds);
}

/// Moves a picture to the right by up to two pixels; what comes in from the left is its edge.
Image<float> moved(const Image<float>& picture, double px) {
  Image<float> result(picture.width(), picture.height(), picture.channels());
  const int whole = static_cast<int>(std::floor(px));
  const auto share = static_cast<float>(px - whole);
  for (int y = 0; y < picture.height(); ++y) {
    for (int x = 0; x < picture.width(); ++x) {
      const int from = std::max(0, x - whole);
      const int left = std::max(0, from - 1);
      for (int c = 0; c < picture.channels(); ++c)
        result.at(x, y, c) =
            (1.0F - share) * picture.at(from, y, c) + share * picture.at(left, y, c);
    }
  }
  return result;
}

void cast_shadow(Image<float>& picture) {
  const auto in = [](int i, int size) { return i >= kShadowFrom * size && i < kShadowTo * size; };
  for (int y = 0; y < picture.height(); ++y) {
    for (int x = 0; x < picture.width(); ++x) {
      if (!in(x, picture.width()) || !in(y, picture.height())) continue;
      for (int c = 0; c < picture.channels(); ++c)
        picture.at(x, y, c) *= static_cast<float>(kShadowLeaves);
    }
  }
}

void swap_red_and_blue(Image<std::uint16_t>& pixels) {
  const std::span<std::uint16_t> s = pixels.samples();
  for (std::size_t i = 0; i + 2 < s.size(); i += 3) std::swap(s[i], s[i + 2]);
}

}  // namespace

/// One exposure from trigger to delivery, with the faults that strike it.
struct Rig::Exposure {
  std::uint64_t session = 0;
  nanoseconds start{};
  nanoseconds requested{};
  nanoseconds measured{};  ///< as the frame says
  nanoseconds open{};      ///< as it was
  std::uint64_t key = 0;   ///< of all its randomness
  int camera_lost = 0;
  bool missing = false;
  std::stop_token session_end = {};
};

/// The light of an exposure, and what is wrong with how it is read.
struct Rig::Picture {
  std::vector<LightStretch> lights;
  double brightness = 1.0;
  double turn = 1.0;  ///< of the wheel, over what it says
  std::uint16_t drift = 0;
  bool swapped = false;
  double moved_px = 0.0;
  bool shadow = false;
};

Result<Rig::Exposure> Rig::trigger(std::uint64_t session,
                                   nanoseconds requested,
                                   const std::stop_token& stop) {
  const CameraOptics& camera = options_.camera;
  if (requested < camera.shortest_exposure || requested > camera.longest_exposure) {
    return invalid_argument(fmt::format("exposure of {} s; expected {} to {} s",
                                        seconds(requested),
                                        seconds(camera.shortest_exposure),
                                        seconds(camera.longest_exposure)));
  }
  std::unique_lock lock(mutex_);
  const auto closed = [&] { return session == 0 || session != camera_session_; };
  const auto free = [&] { return closed() || exposing_session_ != session; };
  if (!exposure_over_.wait_for(lock, stop, kExposureEnds, free)) {
    return stop.stop_requested() ? cancelled("exposure: stopped")
                                 : busy("simulated camera: exposing");
  }
  if (closed()) return unavailable("simulated camera: not open");

  Exposure e{.session = session, .start = clock_.now(), .requested = requested};
  const Shown shown = timeline_.at(e.start);
  const std::uint64_t id = shown ? shown->id : 0;
  e.key = mix(mix(mix(options_.seed, id), shown ? shown->content : 0),
              static_cast<std::uint64_t>(requested.count()));
  const double z = std::clamp(normal_quantile(uniform(mix(e.key, 0x657870))), -3.0, 3.0);
  const double third = plan_.strikes(FaultKind::kWrongExposure, id) ? 4.0 / 3.0 : 1.0;
  e.measured = nanoseconds(std::llround(static_cast<double>(requested.count()) * third *
                                        (1.0 + camera.exposure_error * z)));
  const bool longer = requested >= kLong && plan_.strikes(FaultKind::kUnreportedExposure, id);
  e.open = longer ? e.measured * 11 / 10 : e.measured;
  e.camera_lost = plan_.strikes_for_good(FaultKind::kCameraLost, id);
  e.missing = plan_.strikes(FaultKind::kMissingFrame, id);
  e.session_end = camera_session_end_.get_token();
  exposing_session_ = session;
  return e;
}

Result<Frame> Rig::expose(std::uint64_t session, nanoseconds exposure, std::stop_token stop) {
  if (stop.stop_requested()) return cancelled("exposure: stopped");
  const Result<Exposure> triggered = trigger(session, exposure, stop);
  if (!triggered) return triggered.error();
  std::stop_source over;  // as the caller wishes, or because the camera is no longer the caller's
  const std::stop_callback on_stop(stop, [&] { over.request_stop(); });
  const std::stop_callback on_end(triggered->session_end, [&] { over.request_stop(); });
  Result<Frame> frame = [&]() -> Result<Frame> {
    if (triggered->camera_lost > 0 || triggered->missing)
      return fail_later(*triggered, over.get_token());
    if (!clock_.sleep(triggered->open, over.get_token())) return cancelled("exposure: stopped");
    return finish(*triggered);
  }();
  if (!frame && frame.error().code == ErrorCode::kCancelled && !stop.stop_requested()) {
    frame = unavailable("simulated camera: closed, or opened by somebody else");
  }
  const std::lock_guard lock(mutex_);
  if (exposing_session_ == session) exposing_session_ = 0;
  exposure_over_.notify_all();
  return frame;
}

Result<Frame> Rig::fail_later(const Exposure& exposure, std::stop_token stop) {
  if (exposure.camera_lost > 0) {
    if (!clock_.sleep(exposure.measured / 2, stop)) return cancelled("exposure: stopped");
    const std::lock_guard lock(mutex_);
    if (camera_session_ != exposure.session) return cancelled("exposure: camera closed");
    end_camera_session(0);
    camera_opens_to_fail_ = exposure.camera_lost - 1;
    return unavailable("simulated camera: unplugged");
  }
  const nanoseconds patience = exposure.requested * 3 / 2 + std::chrono::seconds(2);
  if (!clock_.sleep(patience, stop)) return cancelled("exposure: stopped");
  return timeout(fmt::format("simulated camera: no frame after {} s", seconds(patience)));
}

Result<Frame> Rig::finish(const Exposure& exposure) {
  std::vector<LightStretch> lights;
  {
    const std::lock_guard lock(mutex_);
    if (camera_session_ != exposure.session) return cancelled("exposure: camera closed");
    lights = timeline_.during(exposure.start, exposure.open);
    const Shown shown = lights.front().shown;
    if (plan_.strikes(FaultKind::kStaleFrame, shown ? shown->id : 0)) {
      lights = {{timeline_.before(exposure.start), 0.0, seconds(exposure.open)}};
    }
  }
  Frame frame;
  frame.pattern_id = lights.size() == 1 && lights[0].shown ? lights[0].shown->id : 0;
  frame.pixels = picture(exposure, disturbed(std::move(lights), frame.pattern_id));
  frame.sha256 = frame_hash(frame.pixels);
  frame.bit_depth = options_.camera.bit_depth;
  frame.start = exposure.start;
  frame.exposure = exposure.measured;
  if (auto delivered = deliver(exposure, frame); !delivered) return delivered.error();
  return frame;
}

Rig::Picture Rig::disturbed(std::vector<LightStretch> lights, std::uint64_t id) {
  const std::lock_guard lock(mutex_);
  Picture picture{std::move(lights)};
  if (plan_.strikes(FaultKind::kBlackFrame, id)) picture.lights = {};
  if (plan_.strikes(FaultKind::kFlicker, id))
    picture.brightness += mix(options_.seed, exposures_) % 2 == 0 ? kFlickers : -kFlickers;
  if (plan_.strikes(FaultKind::kFadingLamp, id)) lamp_ *= 1.0 - kFades;
  picture.brightness *= lamp_;
  if (plan_.strikes(FaultKind::kMovedSample, id)) moved_px_ = kMovedPx;
  picture.moved_px = moved_px_;
  picture.shadow = plan_.strikes(FaultKind::kShadow, id);
  if (plan_.strikes(FaultKind::kWheelBeat, id)) picture.turn = kFastTurn;
  if (plan_.strikes(FaultKind::kBlackDrift, id)) picture.drift = kDriftedCodes;
  picture.swapped = plan_.strikes(FaultKind::kSwappedChannels, id);
  return picture;
}

Image<std::uint16_t> Rig::picture(const Exposure& exposure, const Picture& picture) const {
  const double turn = picture.turn * seconds(options_.projector.wheel_turn);
  const double phase = turn * uniform(mix(exposure.key, 0x7768656c));
  Image<float> sum(options_.camera.model.width, options_.camera.model.height, 3);
  for (const LightStretch& stretch : picture.lights) {
    if (!stretch.shown) continue;
    Rgb lit = lit_seconds(options_.projector, turn, phase, stretch);
    const double hours = seconds(exposure.start) / 3600.0;
    for (double& channel : lit) channel *= 1.0 + options_.projector.drift_per_hour * hours;
    const std::span<const float> radiance = stretch.shown->light->sensor_radiance.samples();
    for (std::size_t i = 0; i < radiance.size(); ++i) {
      sum.samples()[i] += static_cast<float>(picture.brightness * lit[i % 3]) * radiance[i];
    }
  }
  if (picture.moved_px > 0.0) sum = moved(sum, picture.moved_px);
  if (picture.shadow) cast_shadow(sum);
  Image<std::uint16_t> codes = sensor_.read(sum, seconds(exposure.open), exposure.key);
  const double most = options_.camera.max_code();
  for (std::uint16_t& code : codes.samples())
    code = static_cast<std::uint16_t>(std::min(most, 1.0 * code + picture.drift));
  if (picture.swapped) swap_red_and_blue(codes);
  return codes;
}

/// Numbers the frame, and damages it on the way out where a fault says so.
Result<void> Rig::deliver(const Exposure& exposure, Frame& frame) {
  const std::lock_guard lock(mutex_);
  if (camera_session_ != exposure.session) return cancelled("exposure: camera closed");
  const std::uint64_t id = frame.pattern_id;
  ++exposures_;
  if (last_frame_ && plan_.strikes(FaultKind::kDuplicateFrame, id)) {
    frame = *last_frame_;
    return ok();
  }
  trigger_count_ += plan_.strikes(FaultKind::kSkippedTrigger, id) ? 2 : 1;
  frame.trigger_count = trigger_count_;
  const Frame intact = frame;
  if (plan_.strikes(FaultKind::kTornFrame, id)) {
    const std::span<std::uint16_t> samples = frame.pixels.samples();
    const auto lower = samples.subspan(samples.size() / 2);
    std::fill(lower.begin(), lower.end(), std::uint16_t{0});
    if (last_frame_ && last_frame_->pixels != intact.pixels) {
      const auto old = last_frame_->pixels.samples().subspan(samples.size() / 2);
      std::copy(old.begin(), old.end(), lower.begin());
    }
  }
  if (last_frame_ && plan_.strikes(FaultKind::kTimeBackwards, id)) {
    frame.start = last_frame_->start - std::chrono::milliseconds(1);
  }
  log::debug("simulated camera: frame {}, pattern {}, {} s",
             frame.trigger_count,
             id,
             seconds(exposure.measured));
  last_frame_ = intact;
  return ok();
}

}  // namespace opaline::sim
