#include "daemon/light_switch.h"

#include "sim/rig_client.h"

namespace opaline::daemon {

std::function<Result<void>()> light_switch(const config::RigConfig& rig) {
  const bool outlives_job =
      rig.projector == config::Driver::kSim && rig.sim.run == config::RigPlace::kProcess;
  if (!outlives_job) return [] { return ok(); };
  return [socket = config::rig_socket(rig)] {
    return sim::RigClient(socket).dark(sim::RigPort::kAnybody);
  };
}

}  // namespace opaline::daemon
