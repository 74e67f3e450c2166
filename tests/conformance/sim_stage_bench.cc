#include <thread>

#include "sim/rig_client.h"
#include "sim/rig_server.h"
#include "sim/sim_light_stage.h"
#include "tests/conformance/stage_bench.h"
#include "tests/support/temporary_directory.h"
#include "tests/support/tiny_sphere.h"

namespace opaline::conformance {
namespace {

std::shared_ptr<const sim::LightPath> traced_once(const support::TinySphere& tiny) {
  static const std::shared_ptr<const sim::LightPath> path = tiny.path();
  return path;
}

class SimStageBench : public StageBench {
 public:
  drivers::LightStage& stage() override { return stage_; }
  void unplug() override { arm({{.kind = sim::FaultKind::kProjectorLost, .count = 1000}}); }
  void plug() override { arm({}); }
  bool is_dark() override {
    std::this_thread::sleep_for(std::chrono::milliseconds(2));  // the latency of 50 ms, sped up
    return !rig_->status()->lamp_on;
  }

 protected:
  void arm(const sim::Faults& faults) {
    if (auto armed = rig_->arm(faults); !armed) std::abort();
  }
  support::TinySphere tiny_;
  std::unique_ptr<sim::Rig> rig_ = tiny_.make_rig(traced_once(tiny_));

 private:
  sim::SimLightStage stage_{*rig_, tiny_.lights};
};

class SocketStageBench : public SimStageBench {
 public:
  drivers::LightStage& stage() override { return stage_; }

 private:
  testing::TemporaryDirectory directory_;
  std::unique_ptr<sim::RigServer> server_ =
      *sim::RigServer::create(*rig_, directory_.path() / "rig.sock");
  std::jthread serving_{[this](std::stop_token stop) {
    if (auto served = server_->serve(std::chrono::hours(1), stop); !served) std::abort();
  }};
  sim::RigClient client_{directory_.path() / "rig.sock"};
  sim::SimLightStage stage_{client_, tiny_.lights};
};

}  // namespace

std::unique_ptr<StageBench> make_sim_stage_bench() { return std::make_unique<SimStageBench>(); }
std::unique_ptr<StageBench> make_socket_stage_bench() {
  return std::make_unique<SocketStageBench>();
}

}  // namespace opaline::conformance
