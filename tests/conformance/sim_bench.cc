#include <thread>

#include "sim/rig.h"
#include "sim/rig_client.h"
#include "sim/rig_server.h"
#include "sim/sim_camera.h"
#include "sim/sim_projector.h"
#include "tests/conformance/device_bench.h"
#include "tests/support/simulated_station.h"
#include "tests/support/temporary_directory.h"

namespace opaline::conformance {
namespace {

sim::RigOptions real_time() {
  sim::RigOptions options = support::tiny_rig();
  options.time_factor = 1.0;
  return options;
}

/// The tiny station at the speed of real time.
class SimBench : public DeviceBench {
 public:
  drivers::Camera& camera() override { return camera_; }
  drivers::Projector& projector() override { return projector_; }
  void unplug_camera() override { arm(sim::FaultKind::kCameraLost); }
  void unplug_projector() override { arm(sim::FaultKind::kProjectorLost); }
  void lose_frame() override { arm(sim::FaultKind::kMissingFrame, 1); }
  void plug() override {
    if (auto armed = rig_->arm({}); !armed) std::abort();
  }

 private:
  void arm(sim::FaultKind kind, int count = 1000) {
    if (auto armed = rig_->arm({{.kind = kind, .count = count}}); !armed) std::abort();
  }
  std::unique_ptr<sim::Rig> rig_ = *sim::Rig::create(real_time(), support::tiny_responses());
  sim::SimCamera camera_{*rig_};
  sim::SimProjector projector_{*rig_};
};

class SocketBench : public DeviceBench {
 public:
  drivers::Camera& camera() override { return camera_; }
  drivers::Projector& projector() override { return projector_; }
  void unplug_camera() override { arm(sim::FaultKind::kCameraLost); }
  void unplug_projector() override { arm(sim::FaultKind::kProjectorLost); }
  void lose_frame() override { arm(sim::FaultKind::kMissingFrame, 1); }
  void plug() override {
    if (auto armed = client_.arm({}); !armed) std::abort();
  }

 private:
  void arm(sim::FaultKind kind, int count = 1000) {
    if (auto armed = client_.arm({{.kind = kind, .count = count}}); !armed) std::abort();
  }
  testing::TemporaryDirectory directory_;
  std::unique_ptr<sim::Rig> rig_ = *sim::Rig::create(real_time(), support::tiny_responses());
  std::unique_ptr<sim::RigServer> server_ =
      *sim::RigServer::create(*rig_, directory_.path() / "rig.sock");
  std::jthread serving_{[this](std::stop_token stop) {
    if (auto served = server_->serve(std::chrono::hours(1), stop); !served) std::abort();
  }};
  sim::RigClient client_{directory_.path() / "rig.sock"};
  sim::SimCamera camera_{client_};
  sim::SimProjector projector_{client_};
};

}  // namespace

std::unique_ptr<DeviceBench> make_sim_bench() { return std::make_unique<SimBench>(); }
std::unique_ptr<DeviceBench> make_socket_bench() { return std::make_unique<SocketBench>(); }

}  // namespace opaline::conformance
