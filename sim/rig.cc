#include "sim/rig.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>

namespace opaline::sim {
namespace {

using std::chrono::nanoseconds;

constexpr std::size_t kRenderedKept = 16;
constexpr nanoseconds kSlowLight = std::chrono::seconds(1);
constexpr double kUnwantedGamma = 2.2;

std::uint64_t content_hash(const Image<std::uint8_t>& codes) {
  std::uint64_t hash =
      mix(static_cast<std::uint64_t>(codes.width()), static_cast<std::uint64_t>(codes.height()));
  const std::span<const std::uint8_t> bytes = codes.samples();
  for (std::size_t i = 0; i < bytes.size(); i += sizeof(std::uint64_t)) {
    std::uint64_t word = 0;
    std::memcpy(&word, &bytes[i], std::min(sizeof(word), bytes.size() - i));
    hash = mix(hash, word);
  }
  return hash;
}

Image<std::uint8_t> with_gamma(Image<std::uint8_t> codes) {
  for (std::uint8_t& code : codes.samples()) {
    code = static_cast<std::uint8_t>(
        std::lround(255.0 * std::pow(static_cast<double>(code) / 255.0, kUnwantedGamma)));
  }
  return codes;
}

}  // namespace

Result<std::unique_ptr<Rig>> Rig::create(const RigOptions& options,
                                         std::shared_ptr<const TransportResponses> responses,
                                         Clock* clock) {
  if (auto good = validate(options); !good) return good.error().in("rig");
  if (auto good = check_responses(*responses, options.camera.model); !good)
    return good.error().in("transport responses");
  return create(options,
                std::make_shared<const StationOptics>(
                    options.camera, options.projector, std::move(responses), options.surface),
                clock);
}

Result<std::unique_ptr<Rig>> Rig::create(const RigOptions& options,
                                         std::shared_ptr<const LightPath> path,
                                         Clock* clock) {
  if (auto good = validate(options); !good) return good.error().in("rig");
  return std::unique_ptr<Rig>(new Rig(options, std::move(path), clock));
}

Rig::Rig(const RigOptions& options, std::shared_ptr<const LightPath> path, Clock* clock)
    : options_(options),
      own_clock_(options.time_factor),
      clock_(clock == nullptr ? *own_clock_ : *clock),
      path_(std::move(path)),
      sensor_(options.camera, options.seed),
      next_session_(
          static_cast<std::uint64_t>(std::chrono::steady_clock::now().time_since_epoch().count())) {
  plan_.arm(options.faults);
}

Result<RigPort::Opened<drivers::CameraInfo>> Rig::open_camera() {
  const std::lock_guard lock(mutex_);
  if (camera_opens_to_fail_ > 0) {
    --camera_opens_to_fail_;
    return unavailable("simulated camera: unplugged");
  }
  end_camera_session(++next_session_);
  trigger_count_ = 0;
  last_frame_.reset();
  return Opened<drivers::CameraInfo>{camera_session_,
                                     {"simulated camera",
                                      fmt::format("sim-{}", options_.seed),
                                      options_.camera.model.width,
                                      options_.camera.model.height,
                                      options_.camera.bit_depth,
                                      options_.camera.shortest_exposure,
                                      options_.camera.longest_exposure}};
}

Result<RigPort::Opened<drivers::ProjectorInfo>> Rig::open_projector() {
  const std::lock_guard lock(mutex_);
  if (projector_opens_to_fail_ > 0) {
    --projector_opens_to_fail_;
    return unavailable("simulated projector: unplugged");
  }
  projector_session_ = ++next_session_;
  darken();
  return Opened<drivers::ProjectorInfo>{projector_session_,
                                        {"simulated projector",
                                         fmt::format("sim-{}", options_.seed),
                                         options_.projector.width,
                                         options_.projector.height,
                                         options_.projector.wheel_turn,
                                         options_.projector.latency}};
}

void Rig::close_camera(std::uint64_t session) noexcept {
  const std::lock_guard lock(mutex_);
  if (session == camera_session_) end_camera_session(0);
}

void Rig::end_camera_session(std::uint64_t next) {
  camera_session_ = next;
  camera_session_end_.request_stop();
  camera_session_end_ = {};
}

void Rig::close_projector(std::uint64_t session) noexcept {
  const std::lock_guard lock(mutex_);
  if (session != projector_session_) return;
  projector_session_ = 0;
  darken();
}

Result<void> Rig::dark(std::uint64_t session) {
  const std::lock_guard lock(mutex_);
  if (session != projector_session_) projector_session_ = 0;
  darken();
  return ok();
}

void Rig::darken() {
  ++darkened_;
  const nanoseconds now = clock_.now();
  const Shown shown = timeline_.at(now);
  if (plan_.strikes(FaultKind::kLampStuck, shown ? shown->id : 0)) return;
  if (shown) path_->darkened();
  timeline_.change(now, nullptr);
}

Shown Rig::render(const drivers::Pattern& pattern) {
  const std::uint64_t state = path_->state();
  const std::uint64_t codes = content_hash(pattern.codes);
  const std::uint64_t content = state == 0 ? codes : mix(codes, state);
  {
    const std::lock_guard lock(mutex_);
    for (const auto& [key, light] : rendered_) {
      if (key == content)
        return std::make_shared<ShownPattern>(ShownPattern{pattern.id, content, light});
    }
  }
  auto light = std::make_shared<const StationLight>(path_->light(pattern.codes));
  const std::lock_guard lock(mutex_);
  rendered_.emplace_back(content, light);
  if (rendered_.size() > kRenderedKept) rendered_.pop_front();
  return std::make_shared<ShownPattern>(ShownPattern{pattern.id, content, std::move(light)});
}

Result<void> Rig::show(std::uint64_t session,
                       const drivers::Pattern& pattern,
                       std::stop_token stop) {
  if (stop.stop_requested()) return cancelled("show: stopped");
  const auto& projector = options_.projector;
  const auto& codes = pattern.codes;
  if (pattern.id == 0) return invalid_argument("pattern id 0; expected > 0");
  if (codes.width() != projector.width || codes.height() != projector.height ||
      codes.channels() != 3) {
    return invalid_argument(fmt::format("pattern {}: {} x {} x {}; expected {} x {} x 3",
                                        pattern.id,
                                        codes.width(),
                                        codes.height(),
                                        codes.channels(),
                                        projector.width,
                                        projector.height));
  }
  const std::uint64_t darkened = [&] {
    const std::lock_guard lock(mutex_);
    return darkened_;
  }();
  const bool gamma = [&] {
    const std::lock_guard lock(mutex_);
    if (plan_.strikes(FaultKind::kMovedBoard, pattern.id)) path_->knocked();
    return plan_.strikes(FaultKind::kGammaOn, pattern.id);
  }();
  Shown shown = render(gamma ? drivers::Pattern{pattern.id, with_gamma(pattern.codes), pattern.name}
                             : pattern);
  const std::lock_guard lock(mutex_);
  if (session == 0 || session != projector_session_)
    return unavailable("simulated projector: not open");
  if (stop.stop_requested()) return cancelled("show: stopped");
  if (darkened != darkened_) return cancelled("show: made dark meanwhile");
  if (const int count = plan_.strikes_for_good(FaultKind::kProjectorLost, pattern.id); count > 0) {
    projector_session_ = 0;
    projector_opens_to_fail_ = count - 1;
    return unavailable("simulated projector: unplugged");
  }
  if (plan_.strikes(FaultKind::kPatternStuck, pattern.id)) return ok();
  const bool slow = plan_.strikes(FaultKind::kSlowProjector, pattern.id);
  timeline_.change(clock_.now() + projector.latency + (slow ? kSlowLight : nanoseconds(0)),
                   std::move(shown));
  return ok();
}

Result<RigStatus> Rig::status() {
  const std::lock_guard lock(mutex_);
  const nanoseconds now = clock_.now();
  const Shown shown = timeline_.at(now);
  return RigStatus{.identity = options_.identity,
                   .lamp_on = shown != nullptr,
                   .pattern_id = shown ? shown->id : 0,
                   .exposures = exposures_,
                   .camera_open = camera_session_ != 0,
                   .projector_open = projector_session_ != 0,
                   .rig_time = now,
                   .time_factor = options_.time_factor,
                   .faults = plan_.left()};
}

Result<RigTruth> Rig::truth() {
  const std::lock_guard lock(mutex_);
  const Shown shown = timeline_.at(clock_.now());
  StationLight dark = path_->dark();
  RigTruth truth{.scene = path_->scene(),
                 .pattern_id = shown ? shown->id : 0,
                 .patches_x = path_->patches_x(),
                 .patches_y = path_->patches_y(),
                 .patch_irradiance = std::move(dark.patch_irradiance),
                 .surface_radiance = std::move(dark.surface_radiance)};
  if (shown) {
    truth.patch_irradiance = shown->light->patch_irradiance;
    truth.surface_radiance = shown->light->surface_radiance;
  }
  return truth;
}

Result<void> Rig::arm(const Faults& faults) {
  const std::lock_guard lock(mutex_);
  plan_.arm(faults);
  camera_opens_to_fail_ = projector_opens_to_fail_ = 0;
  return ok();
}

Result<void> Rig::add(const Faults& faults) {
  const std::lock_guard lock(mutex_);
  plan_.add(faults);
  return ok();
}

}  // namespace opaline::sim
