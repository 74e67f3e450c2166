#include "tests/support/tiny_capture.h"

#include <algorithm>
#include <utility>

#include "base/ensure.h"
#include "tests/support/simulated_station.h"

namespace opaline::support {

capture::StationCalibration calibration_of(const sim::RigOptions& options) {
  const sim::CameraOptics& c = options.camera;
  const sim::ProjectorOptics& p = options.projector;
  capture::StationCalibration calibration;
  calibration.camera.model = c.model;
  calibration.camera.bit_depth = c.bit_depth;
  if (c.response_gamma != 1.0) {
    calibration.camera.response = {capture::ResponseCurve::Kind::kGamma, c.response_gamma, {}};
  }
  calibration.camera.black_level = c.black_level;
  calibration.camera.gain_electrons_per_code = c.gain_electrons_per_code;
  calibration.camera.full_well_electrons = c.full_well_electrons;
  calibration.camera.read_noise_electrons = c.read_noise_electrons;
  calibration.camera.vignetting = {c.vignetting};
  calibration.camera.sensitivity = c.sensitivity;
  calibration.projector.width = p.width;
  calibration.projector.height = p.height;
  calibration.projector.mm_per_pixel = p.mm_per_pixel;
  calibration.projector.offset_x_px = p.offset_x_px;
  calibration.projector.offset_y_px = p.offset_y_px;
  calibration.projector.gamma = p.gamma;
  calibration.projector.black_level = p.black_level;
  calibration.projector.vignetting = {p.vignetting};
  calibration.projector.peak_irradiance = p.peak_irradiance;
  return calibration;
}

capture::CaptureTask tiny_task(const sim::RigOptions& options) {
  const auto responses = tiny_responses();
  capture::CaptureTask task;
  task.options.patterns.regions = 2;
  task.options.patterns.held_out_lights = 7;
  task.sample = {responses->block, responses->ior, responses->lit_face, responses->seen_face};
  task.calibration = calibration_of(options);
  return task;
}

void RecordingSink::progress(const Progress& progress) {
  const std::lock_guard lock(mutex_);
  progresses_.push_back(progress);
}

Result<void> RecordingSink::fact(std::string_view type, const nlohmann::json& data) {
  const std::lock_guard lock(mutex_);
  facts_.push_back({std::string(type), data});
  return ok();
}

std::vector<RecordingSink::Fact> RecordingSink::facts() const {
  const std::lock_guard lock(mutex_);
  return facts_;
}

std::vector<nlohmann::json> RecordingSink::facts(std::string_view type) const {
  std::vector<nlohmann::json> found;
  for (const Fact& fact : facts()) {
    if (fact.type == type) found.push_back(fact.data);
  }
  return found;
}

std::vector<Progress> RecordingSink::progresses() const {
  const std::lock_guard lock(mutex_);
  return progresses_;
}

Result<void> LogSink::fact(std::string_view type, const nlohmann::json& data) {
  const auto appended = log_.append(type, data);
  return appended ? ok() : Result<void>(appended.error());
}

namespace {

std::unique_ptr<sim::Rig> make_rig(const sim::RigOptions& options,
                                   std::shared_ptr<const TransportResponses> responses,
                                   Clock& clock) {
  auto made = sim::Rig::create(options, std::move(responses), &clock);
  ENSURE(made.has_value());
  return *std::move(made);
}

}  // namespace

TinyStation::TinyStation(const sim::RigOptions& options,
                         std::shared_ptr<const TransportResponses> responses)
    : rig_(make_rig(options, std::move(responses), clock_)), camera_(*rig_), projector_(*rig_) {}

std::vector<std::pair<std::string, std::vector<std::byte>>> files_below(
    const std::filesystem::path& directory) {
  std::vector<std::pair<std::string, std::vector<std::byte>>> files;
  if (!std::filesystem::exists(directory)) return files;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(directory)) {
    if (!entry.is_regular_file()) continue;
    auto bytes = read_bytes(entry.path(), std::size_t{1} << 30);
    ENSURE(bytes.has_value());
    files.emplace_back(std::filesystem::relative(entry.path(), directory).string(),
                       *std::move(bytes));
  }
  std::ranges::sort(files);
  return files;
}

}  // namespace opaline::support
