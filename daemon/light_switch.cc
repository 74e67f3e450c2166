#include "daemon/light_switch.h"

#include <memory>
#include <utility>

#include "drivers/udmx/udmx_stage.h"
#include "sim/rig_client.h"

namespace opaline::daemon {
namespace {

/// Not the acknowledgement counts, but what the lamp does.
Result<void> make_dark(const std::filesystem::path& socket) {
  sim::RigClient rig(socket);
  if (auto told = rig.dark(sim::RigPort::kAnybody); !told) return told;
  const auto status = rig.status();
  if (!status) return status.error();
  if (status->lamp_on) return unavailable("the lamp was told to go dark, and is still on");
  return ok();
}

}  // namespace

std::function<Result<void>()> light_switch(const config::RigConfig& rig,
                                           std::function<std::unique_ptr<drivers::UdmxBus>()> bus) {
  if (rig.light_stage.driver == config::StageDriver::kUdmx) {
    drivers::UdmxOptions options = rig.light_stage.udmx;
    options.lights = rig.light_stage.lights();
    return [options, bus = std::move(bus)] { return drivers::UdmxStage(options, bus()).blank(); };
  }
  const bool simulated = rig.has_stage() || rig.projector == config::Driver::kSim;
  const bool outlives_job = simulated && rig.sim.run == config::RigPlace::kProcess;
  if (!outlives_job) return [] { return ok(); };
  return [socket = config::rig_socket(rig)] { return make_dark(socket); };
}

}  // namespace opaline::daemon
