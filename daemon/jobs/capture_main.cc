#include <stop_token>

#include "base/log.h"
#include "capture/sequence.h"
#include "config/session_config.h"
#include "daemon/driver_table.h"
#include "daemon/jobs/guardian.h"
#include "daemon/jobs/job.h"
#include "daemon/jobs/station_lock.h"

// opaline-capture SESSION_DIR: shows the session's lights, takes their frames, and writes frames/, hdr/ and the dataset.

namespace {

using opaline::Result;
namespace daemon = opaline::daemon;

Result<void> capture(daemon::JobContext& context) {
  const auto config = opaline::config::load_resolved(context.session);
  if (!config) return config.error();
  const auto station = daemon::lock_station(config->rig.station);
  if (!station) return station.error();
  const auto& directory = context.session.path();
  const auto devices =
      daemon::StationDevices::create(config->rig, directory, context.events, context.stop);
  if (!devices) return devices.error();
  const auto program = daemon::program_beside("opaline-guardian");
  if (!program) return program.error();
  const auto guardian = daemon::Guardian::start(*program, directory, context.stop);
  if (!guardian) return guardian.error();
  std::stop_source stop;
  const auto request = [&stop] { stop.request_stop(); };
  const std::stop_callback asked(context.stop, request);
  const std::stop_callback unguarded((*guardian)->death(), request);
  const auto summary =
      opaline::capture::capture_session({config->capture, config->sample, config->rig.calibration},
                                        (*devices)->station(),
                                        {directory, context.files, context.events},
                                        stop.get_token());
  if (!summary && (*guardian)->death().stop_requested()) {
    return opaline::unavailable("the guardian died, and without one no light stays on");
  }
  if (!summary) return summary.error();
  opaline::log::info("capture: {} lights, {} taken now, {} times taken again, {} unusable",
                     summary->lights,
                     summary->taken,
                     summary->retaken,
                     summary->unusable.size());
  return opaline::ok();
}

}  // namespace

int main(int argc, char** argv) {
  return daemon::run_job(
      argc, argv, {"capture", "Captures a session's lights into its dataset."}, capture);
}
