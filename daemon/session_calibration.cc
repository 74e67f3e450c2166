#include "daemon/session_calibration.h"

#include <fmt/format.h>

#include <optional>
#include <system_error>
#include <utility>

#include "calibration/frame_taker.h"
#include "calibration/measured_station.h"
#include "calibration/procedure.h"
#include "calibration/sample_finder.h"
#include "calibration/store.h"
#include "daemon/session_camera.h"

namespace opaline::daemon {
namespace {

namespace fs = std::filesystem;
using calibration::Record;

bool is_there(const fs::path& path) {
  std::error_code none;
  return fs::exists(path, none);
}

std::string describe(const Record& record) {
  return fmt::format(
      "calibration {} of {}: black {:.2f}, gain {:.3f} electrons a code, read noise {:.2f} "
      "electrons, response {}",
      record.version,
      record.created,
      record.measured.black_level.value_or(0.0),
      record.measured.gain_electrons_per_code.value_or(0.0),
      record.measured.read_noise_electrons.value_or(0.0),
      record.measured.response && !record.measured.response->table.empty() ? "measured" : "linear");
}

Result<void> ask_station(const Record& record,
                         const config::RigConfig& rig,
                         const capture::Station& station,
                         EventSink& events,
                         std::stop_token stop) {
  const auto agreement =
      calibration::compare_with_station(record, rig.calibration, station, events, std::move(stop));
  if (!agreement) return agreement.error().in("calibration");
  if (!agreement->wrong.empty()) {
    return invalid_argument(fmt::format(
        "the station contradicts its active calibration {}: {}; mend that, or calibrate anew with "
        "\"opaline calibrate RIG.toml\", or write calibration.use = \"given\" into the rig file",
        record.version,
        agreement->wrong));
  }
  for (const std::string& doubt : agreement->doubts) {
    auto noted = events.fact(
        "calibration.warning",
        {{"message",
          fmt::format("{}: is calibration {} still right? \"opaline calibrate\" makes a new one",
                      doubt,
                      record.version)}});
    if (!noted) return noted;
  }
  return ok();
}

bool has_begun(const SessionDirectory& session) {
  return is_there(session.frames() / "black" / "index.json");
}

/// The session's own; an empty one where it has none.
Result<Record> record_of(const SessionDirectory& session) {
  if (!is_there(session.calibration())) return Record{};
  const auto text = read_text(session.calibration());
  if (!text) return text.error();
  return calibration::record_from_text(*text, session.calibration().string());
}

Result<capture::StationCalibration> measured_calibration(const SessionDirectory& session,
                                                         const config::RigConfig& rig,
                                                         const fs::path& calibrations,
                                                         const capture::Station& station,
                                                         FileOperations& files,
                                                         EventSink& events,
                                                         std::stop_token stop) {
  const fs::path own = session.calibration();
  if (is_there(own)) {
    const auto record = record_of(session);
    if (!record) return record.error();
    return calibration::with_measured(rig.calibration, record->measured);
  }
  if (has_begun(session) || rig.calibration_use == config::CalibrationUse::kGiven)
    return rig.calibration;
  const auto active = calibration::Store(files, calibrations, rig.station).read_active();
  if (!active) return active.error();
  if (!*active) return rig.calibration;
  const Record& record = **active;
  if (auto agreed = ask_station(record, rig, station, events, std::move(stop)); !agreed)
    return agreed.error();
  if (auto made = files.make_directories(own.parent_path()); !made) return made.error();
  if (auto kept = write_whole(files, own, to_text(record)); !kept) return kept.error();
  auto noted = events.fact(
      "calibration.used",
      {{"version", record.version}, {"created", record.created}, {"message", describe(record)}});
  if (!noted) return noted.error();
  return calibration::with_measured(rig.calibration, record.measured);
}

fs::path placement_file(const SessionDirectory& session) {
  return session.calibration().parent_path() / "placement.json";
}

Result<calibration::Placement> found_placement(const SessionDirectory& session,
                                               const config::RigConfig& rig,
                                               const capture::StationCalibration& calibration,
                                               const capture::Station& station,
                                               EventSink& events,
                                               std::stop_token stop) {
  auto record = record_of(session);  // what the sensor's steps believe
  if (!record) return record.error();
  const auto taker = calibration::FrameTaker::create(station, events);
  if (!taker) return taker.error();
  calibration::StepContext context{
      **taker, calibration, *record, events, std::move(stop), "placement"};
  return calibration::find_sample(context, calibration.camera.model, rig.holder);
}

Result<void> note_placement(const calibration::Placement& placement,
                            const CameraModel& given,
                            EventSink& events) {
  CameraModel placed = given;
  placed.camera_from_sample = placement.camera_from_sample;
  const double off = length(placed.centre() - given.centre());
  return events.fact(
      "placement.measured",
      {{"corners", placement.corners},
       {"rms_px", placement.rms_px},
       {"deviation_mm", placement.deviation_mm},
       {"from_rig_file_mm", off},
       {"message",
        fmt::format(
            "the sample's place by {} corners of its holder, {:.3f} px left of them, known to "
            "{:.4f} mm; the camera stands {:.2f} mm from where the rig file has it",
            placement.corners,
            placement.rms_px,
            placement.deviation_mm,
            off)}});
}

/// The session's own placement; none where it is to go on without.
Result<std::optional<calibration::Placement>> own_placement(
    const SessionDirectory& session,
    const config::RigConfig& rig,
    const capture::StationCalibration& calibration,
    const capture::Station& station,
    FileOperations& files,
    EventSink& events,
    std::stop_token stop) {
  if (!rig.holder.is_there() || rig.calibration_use == config::CalibrationUse::kGiven)
    return std::nullopt;
  const fs::path file = placement_file(session);
  if (is_there(file)) {
    const auto text = read_text(file);
    if (!text) return text.error();
    const auto kept = calibration::placement_from_text(*text, file.string());
    if (!kept) return kept.error();
    return *kept;
  }
  if (has_begun(session)) return std::nullopt;
  const auto found = found_placement(session, rig, calibration, station, events, std::move(stop));
  if (!found) return found.error().in("placement");
  if (auto made = files.make_directories(file.parent_path()); !made) return made.error();
  if (auto kept = write_whole(files, file, to_text(*found)); !kept) return kept.error();
  if (auto noted = note_placement(*found, calibration.camera.model, events); !noted)
    return noted.error();
  return *found;
}

}  // namespace

Result<capture::StationCalibration> session_calibration(const SessionDirectory& session,
                                                        const config::RigConfig& rig,
                                                        const fs::path& calibrations,
                                                        const capture::Station& station,
                                                        FileOperations& files,
                                                        EventSink& events,
                                                        std::stop_token stop) {
  auto calibration = measured_calibration(session, rig, calibrations, station, files, events, stop);
  if (!calibration) return calibration;
  const auto placement =
      own_placement(session, rig, *calibration, station, files, events, std::move(stop));
  if (!placement) return placement.error();
  if (*placement) {
    const auto record = record_of(session);
    if (!record) return record.error();
    *calibration = calibration::with_place(
        *calibration, record->measured, (*placement)->camera_from_sample, (*placement)->covariance);
  }
  if (!(calibration->camera.model == rig.calibration.camera.model)) {
    if (auto kept = keep_camera(session, files, calibration->camera.model); !kept)
      return kept.error();
  }
  return calibration;
}

}  // namespace opaline::daemon
