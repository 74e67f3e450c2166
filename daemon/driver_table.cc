#include "daemon/driver_table.h"

#include <fmt/format.h>

#include <system_error>
#include <utility>

#include "capture/stage_projector.h"
#include "daemon/runtime_paths.h"
#include "daemon/simulated_rig.h"
#include "drivers/replay/replay_camera.h"
#include "drivers/replay/replay_projector.h"
#include "drivers/udmx/udmx_stage.h"
#include "sim/rig.h"
#include "sim/rig_client.h"
#include "sim/sim_camera.h"
#include "sim/sim_light_stage.h"
#include "sim/sim_projector.h"

namespace opaline::daemon {
namespace {

namespace fs = std::filesystem;

Result<std::unique_ptr<sim::RigPort>> connect_rig(const config::RigConfig& rig,
                                                  const fs::path& session,
                                                  EventSink& events,
                                                  const std::stop_token& stop) {
  if (rig.sim.run == config::RigPlace::kInside) {
    auto built = build_rig(rig.sim, events, stop);
    if (!built) return built.error();
    return std::unique_ptr<sim::RigPort>(*std::move(built));
  }
  if (rig.sim.socket.empty()) {  // then it lies in our own directory, if that is ours
    if (const auto own = runtime_directory(); !own) return own.error();
  }
  const auto program = program_beside("opaline-rig");
  if (!program) return program.error();
  RigProcess process;
  process.program = *program;
  process.arguments = {"serve", "--session", fs::absolute(session).string()};
  process.socket = config::rig_socket(rig);
  process.identity = rig_identity(rig.sim);
  if (auto running = ensure_rig_process(process, stop); !running) return running.error();
  return std::unique_ptr<sim::RigPort>(std::make_unique<sim::RigClient>(process.socket));
}

std::unique_ptr<drivers::LightStage> make_stage(const config::RigConfig& rig,
                                                sim::RigPort* simulated) {
  if (rig.light_stage.driver == config::StageDriver::kSim)
    return std::make_unique<sim::SimLightStage>(*simulated, rig.sim.lights);
  drivers::UdmxOptions options = rig.light_stage.udmx;
  options.lights = rig.light_stage.lights();
  return std::make_unique<drivers::UdmxStage>(std::move(options), drivers::make_usb_bus());
}

}  // namespace

Result<fs::path> program_beside(const char* name) {
  std::error_code error;
  const fs::path self = fs::read_symlink("/proc/self/exe", error);
  const fs::path program = self.parent_path() / name;
  if (!error && fs::exists(program, error)) return program;
  return not_found(fmt::format("{} is not installed beside this program", name));
}

Result<std::unique_ptr<StationDevices>> StationDevices::create(const config::RigConfig& rig,
                                                               const fs::path& session,
                                                               EventSink& events,
                                                               std::stop_token stop) {
  std::unique_ptr<StationDevices> devices(new StationDevices());
  devices->clock_ =
      std::make_unique<SystemClock>(rig.is_simulated() ? rig.sim.rig.time_factor : 1.0);
  if (rig.is_simulated()) {
    auto connected = connect_rig(rig, session, events, stop);
    if (!connected) return connected.error();
    devices->rig_ = *std::move(connected);
  }
  switch (rig.camera) {
    case config::Driver::kSim:
      devices->camera_ = std::make_unique<sim::SimCamera>(*devices->rig_);
      break;
    case config::Driver::kReplay:
      devices->camera_ =
          std::make_unique<drivers::ReplayCamera>(rig.replay_folder, *devices->clock_);
      break;
  }
  if (rig.has_stage()) {
    devices->light_stage_ = make_stage(rig, devices->rig_.get());
    devices->projector_ = std::make_unique<capture::StageProjector>(*devices->light_stage_);
    return devices;
  }
  switch (rig.projector) {
    case config::Driver::kSim:
      devices->projector_ = std::make_unique<sim::SimProjector>(*devices->rig_);
      break;
    case config::Driver::kReplay:
      devices->projector_ = std::make_unique<drivers::ReplayProjector>(rig.replay_folder);
      break;
  }
  return devices;
}

}  // namespace opaline::daemon
