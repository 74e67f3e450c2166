#include "daemon/session_calibration.h"

#include <fmt/format.h>

#include <system_error>
#include <utility>

#include "calibration/procedure.h"
#include "calibration/store.h"

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

}  // namespace

Result<capture::StationCalibration> session_calibration(const SessionDirectory& session,
                                                        const config::RigConfig& rig,
                                                        const fs::path& calibrations,
                                                        const capture::Station& station,
                                                        FileOperations& files,
                                                        EventSink& events,
                                                        std::stop_token stop) {
  const fs::path own = session.calibration();
  if (is_there(own)) {
    const auto text = read_text(own);
    if (!text) return text.error();
    const auto record = calibration::record_from_text(*text, own.string());
    if (!record) return record.error();
    return calibration::with_measured(rig.calibration, record->measured);
  }
  const bool begun = is_there(session.frames() / "black" / "index.json");
  if (begun || rig.calibration_use == config::CalibrationUse::kGiven) return rig.calibration;
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

}  // namespace opaline::daemon
