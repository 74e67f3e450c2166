#include "daemon/simulated_rig.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <signal.h>
#include <sys/socket.h>

#include <cstdlib>

#include "base/files.h"
#include "base/unix_socket.h"
#include "config/session_config.h"
#include "daemon/light_switch.h"
#include "sim/rig_client.h"
#include "sim/sim_camera.h"
#include "sim/sim_projector.h"
#include "tests/support/named_directory.h"
#include "tests/support/process.h"
#include "tests/support/temporary_directory.h"

namespace opaline::daemon {
namespace {

using ::testing::HasSubstr;

/// A station small enough that its light transport is computed in no time.
constexpr const char* kRig = R"(
[station]
name = "tiny"
[camera]
driver = "sim"
[projector]
driver = "sim"
[sim]
run = "process"
seed = {seed}
time_factor = 1000
[sim.scene]
kind = "wax"
size = ["8 mm", "8 mm", "4 mm"]
cells = [4, 4, 2]
[sim.transport]
patches = [2, 2]
photons_per_patch = 32768
cache = "cache"
)";

class SimulatedRigTest : public ::testing::Test {
 protected:
  void TearDown() override {
    if (stopped_ > 0) ::kill(stopped_, SIGCONT);
    if (auto ended = sim::RigClient(socket_).end(); !ended) SUCCEED() << "there is none";
  }
  config::RigConfig read_rig(int seed) {
    std::string text = kRig;
    text.replace(text.find("{seed}"), 6, std::to_string(seed));
    EXPECT_TRUE(write_whole(system_files(), rig_file_, text));
    const auto rig = config::load_rig(rig_file_);
    EXPECT_TRUE(rig) << rig.error().message;
    return rig.value_or(config::RigConfig{});
  }
  RigProcess process_of(const config::RigConfig& rig) {
    const auto programs = testing::named_directory("OPALINE_BIN_DIR");
    return {.program = programs / "opaline-rig",
            .arguments = {"serve", "--config", rig_file_.string()},
            .socket = socket_,
            .identity = rig_identity(rig.sim),
            .patience = std::chrono::seconds(60)};
  }

  /// The process that serves the socket.
  pid_t rig_pid() const {
    const auto connection = connect_unix(socket_);
    ucred peer{};
    socklen_t size = sizeof(peer);
    EXPECT_EQ(::getsockopt(connection->get(), SOL_SOCKET, SO_PEERCRED, &peer, &size), 0);
    return peer.pid;
  }

  testing::TemporaryDirectory directory_;
  std::filesystem::path rig_file_ = directory_.path() / "rig.toml";
  std::filesystem::path socket_ = directory_.path() / "run" / "rig.sock";
  pid_t stopped_ = 0;
};

TEST_F(SimulatedRigTest, IsStartedWhereNobodyServesAndFoundTheNextTime) {
  const RigProcess process = process_of(read_rig(1));
  const auto started = ensure_rig_process(process, {});
  ASSERT_TRUE(started) << started.error().message;
  sim::RigClient client(socket_);
  ASSERT_TRUE(client.arm({{.kind = sim::FaultKind::kTornFrame}}));
  ASSERT_TRUE(ensure_rig_process(process, {}));
  EXPECT_EQ(client.status()->faults.size(), 1u);  // it is still the same
}

TEST_F(SimulatedRigTest, OfOtherOptionsIsReplaced) {
  ASSERT_TRUE(ensure_rig_process(process_of(read_rig(1)), {}));
  const config::RigConfig other = read_rig(2);
  const auto replaced = ensure_rig_process(process_of(other), {});
  ASSERT_TRUE(replaced) << replaced.error().message;
  EXPECT_EQ(sim::RigClient(socket_).status()->identity, rig_identity(other.sim));
}

TEST_F(SimulatedRigTest, ThatIsStoppedIsSaidNotToAnswer) {
  RigProcess process = process_of(read_rig(1));
  ASSERT_TRUE(ensure_rig_process(process, {}));
  stopped_ = rig_pid();
  ASSERT_EQ(::kill(stopped_, SIGSTOP), 0);
  const auto start = std::chrono::steady_clock::now();
  EXPECT_EQ(sim::RigClient(socket_).status().error().code, ErrorCode::kTimeout);
  EXPECT_LT(std::chrono::steady_clock::now() - start,
            std::chrono::seconds(4));  // 2, and a busy machine
  process.patience = std::chrono::seconds(1);
  const auto found = ensure_rig_process(process, {});
  ASSERT_FALSE(found);
  EXPECT_EQ(found.error().code, ErrorCode::kTimeout);
  EXPECT_THAT(found.error().message, HasSubstr("neither answers nor ends; is it stopped?"));
}

TEST_F(SimulatedRigTest, IsAnotherWhenItsStoredLightTransportIs) {
  config::SimConfig sim = read_rig(1).sim;
  sim.responses = directory_.path() / "stored.transport";
  std::vector<std::string> identities;
  for (const char digit : {'a', 'b'}) {
    ASSERT_TRUE(write_whole(system_files(), sim.responses, "..." + std::string(64, digit) + "\n"));
    identities.push_back(rig_identity(sim));
    EXPECT_EQ(rig_identity(sim), identities.back());
  }
  EXPECT_NE(identities[0], identities[1]);
}

TEST_F(SimulatedRigTest, ItsLightSwitchSucceedsOnlyWhenTheLampIsDark) {
  config::RigConfig rig = read_rig(1);
  rig.sim.socket = socket_;
  ASSERT_TRUE(ensure_rig_process(process_of(rig), {}));
  sim::RigClient client(socket_);
  sim::SimProjector projector(client);
  ASSERT_TRUE(projector.open());
  const auto info = projector.info();
  ASSERT_TRUE(info);
  ASSERT_TRUE(projector.show({1, Image<std::uint8_t>(info->width, info->height, 3, 255)}, {}));
  ASSERT_TRUE(testing::eventually([&] { return client.status()->lamp_on; }));
  ASSERT_TRUE(client.arm({{.kind = sim::FaultKind::kLampStuck}}));
  const auto make_dark = light_switch(rig);
  const auto stuck = make_dark();
  ASSERT_FALSE(stuck);
  EXPECT_THAT(stuck.error().message, HasSubstr("still on"));
  EXPECT_TRUE(make_dark());
  EXPECT_FALSE(client.status()->lamp_on);
}

TEST_F(SimulatedRigTest, GivesTheSamePixelsInAProcessAsInside) {
  const config::RigConfig rig = read_rig(1);
  ASSERT_TRUE(ensure_rig_process(process_of(rig), {}));
  NullSink nobody;
  const auto inside = build_rig(rig.sim, nobody, {});
  ASSERT_TRUE(inside) << inside.error().message;
  sim::RigClient outside(socket_);
  std::string hashes[2];
  int i = 0;
  for (sim::RigPort* port :
       {static_cast<sim::RigPort*>(inside->get()), static_cast<sim::RigPort*>(&outside)}) {
    sim::SimCamera camera(*port);
    sim::SimProjector projector(*port);
    ASSERT_TRUE(camera.open());
    ASSERT_TRUE(projector.open());
    const auto info = projector.info();
    ASSERT_TRUE(projector.show({1, Image<std::uint8_t>(info->width, info->height, 3, 255)}, {}));
    ASSERT_TRUE(testing::eventually([&] { return port->status()->lamp_on; }));
    const auto frame = camera.capture({std::chrono::seconds(1), 1}, {});
    ASSERT_TRUE(frame) << frame.error().message;
    EXPECT_EQ(frame->pattern_id, 1u);
    hashes[i++] = frame->sha256;
  }
  EXPECT_EQ(hashes[0], hashes[1]);
}

TEST_F(SimulatedRigTest, ThatCannotStartNamesItsLog) {
  RigProcess process = process_of(read_rig(1));
  process.arguments = {"serve", "--config", (directory_.path() / "missing.toml").string()};
  const auto started = ensure_rig_process(process, {});
  ASSERT_FALSE(started);
  EXPECT_EQ(started.error().code, ErrorCode::kUnavailable);
  EXPECT_THAT(started.error().message, HasSubstr("rig.sock.log"));
}

TEST_F(SimulatedRigTest, WaitingForItCanBeCancelled) {
  std::stop_source stop;
  stop.request_stop();
  const auto started = ensure_rig_process(process_of(read_rig(1)), stop.get_token());
  ASSERT_FALSE(started);
  EXPECT_EQ(started.error().code, ErrorCode::kCancelled);
}

}  // namespace
}  // namespace opaline::daemon
