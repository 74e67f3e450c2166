#include <stop_token>
#include <utility>

#include "base/log.h"
#include "capture/gradient_sequence.h"
#include "capture/sequence.h"
#include "config/session_config.h"
#include "daemon/driver_table.h"
#include "daemon/jobs/guardian.h"
#include "daemon/jobs/job.h"
#include "daemon/jobs/station_lock.h"
#include "daemon/runtime_paths.h"
#include "daemon/session_calibration.h"

// opaline-capture SESSION_DIR: shows the session's lights, takes their frames, and writes frames/, hdr/ and the dataset.

namespace {

using opaline::Result;
namespace daemon = opaline::daemon;

Result<void> capture_block(const opaline::config::SessionConfig& config,
                           const opaline::capture::Station& station,
                           const opaline::capture::Workplace& workplace,
                           const std::stop_token& stop) {
  const auto summary = opaline::capture::capture_session(
      {config.capture, config.sample, config.rig.calibration}, station, workplace, stop);
  if (!summary) return summary.error();
  opaline::log::info("capture: {} lights, {} taken now, {} times taken again, {} unusable",
                     summary->lights,
                     summary->taken,
                     summary->retaken,
                     summary->unusable.size());
  return opaline::ok();
}

Result<void> capture_sphere(const opaline::config::SessionConfig& config,
                            const opaline::capture::Station& station,
                            const opaline::capture::Workplace& workplace,
                            const std::stop_token& stop) {
  const auto summary = opaline::capture::capture_gradients(
      {config.capture,
       config.led_sphere.capture,
       config.rig.calibration.camera,
       config.rig.light_stage.lights(),
       config.rig.light_stage.depolarised,
       config.rig.light_stage.has_beam() && config.led_sphere.beam},
      station,
      workplace,
      stop);
  if (!summary) return summary.error();
  opaline::log::info("capture: {} pictures, {} taken now, {} times taken again, drift {:.2f} %",
                     summary->pictures,
                     summary->taken,
                     summary->retaken,
                     100.0 * summary->drift);
  return opaline::ok();
}

Result<void> capture(daemon::JobContext& context) {
  auto config = opaline::config::load_resolved(context.session);
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
  const bool in_sphere = config->kind == opaline::config::SessionKind::kLedSphere;
  if (!in_sphere) {
    auto calibration = daemon::session_calibration(context.session,
                                                   config->rig,
                                                   daemon::default_calibrations(),
                                                   (*devices)->station(),
                                                   context.files,
                                                   context.events,
                                                   stop.get_token());
    if (!calibration) return calibration.error();
    config->rig.calibration = *std::move(calibration);
  }
  auto done = (in_sphere ? capture_sphere : capture_block)(
      *config, (*devices)->station(), {directory, context.files, context.events}, stop.get_token());
  if (!done && (*guardian)->death().stop_requested()) {
    return opaline::unavailable("the guardian died, and without one no light stays on");
  }
  return done;
}

}  // namespace

int main(int argc, char** argv) {
  return daemon::run_job(
      argc, argv, {"capture", "Captures a session's lights into its dataset."}, capture);
}
