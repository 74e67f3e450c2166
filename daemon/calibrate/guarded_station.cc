#include "daemon/calibrate/guarded_station.h"

#include <string>

#include "base/files.h"
#include "base/session_directory.h"
#include "config/session_config.h"
#include "daemon/driver_table.h"
#include "daemon/jobs/guardian.h"

namespace opaline::daemon {
namespace {

namespace fs = std::filesystem;

Result<fs::path> make_place(const fs::path& directory,
                            const config::RigConfig& rig,
                            const std::string& rig_text) {
  std::error_code none;
  if (fs::exists(directory / "session.json", none)) return directory;
  config::SessionConfig session;
  session.name = "calibration";
  session.rig = rig;
  const auto made = SessionDirectory::create(
      system_files(), directory, {"calibration", "", rig_text, config::to_toml(session)});
  if (!made) return made.error();
  return directory;
}

}  // namespace

Result<void> with_station(const fs::path& rig_file,
                          const config::RigConfig& rig,
                          const fs::path& directory,
                          EventSink& events,
                          const std::stop_token& asked,
                          const WithStation& work) {
  const auto text = read_text(rig_file);
  if (!text) return text.error();
  const auto place = make_place(directory, rig, *text);
  if (!place) return place.error();
  const auto devices = StationDevices::create(rig, *place, events, asked);
  if (!devices) return devices.error();
  const auto program = program_beside("opaline-guardian");
  if (!program) return program.error();
  const auto guardian = Guardian::start(*program, *place, asked);
  if (!guardian) return guardian.error();
  std::stop_source stop;
  const auto request = [&stop] { stop.request_stop(); };
  const std::stop_callback on_signal(asked, request);
  const std::stop_callback unguarded((*guardian)->death(), request);
  auto done = work((*devices)->station(), stop.get_token());
  if ((*guardian)->death().stop_requested())
    return unavailable("the guardian died, and without one no light stays on");
  return done;
}

}  // namespace opaline::daemon
