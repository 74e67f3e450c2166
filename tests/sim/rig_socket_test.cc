#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <thread>

#include "base/unix_socket.h"
#include "sim/rig.h"
#include "sim/rig_client.h"
#include "sim/rig_codec.h"
#include "sim/rig_server.h"
#include "sim/sim_camera.h"
#include "sim/sim_projector.h"
#include "tests/support/simulated_station.h"
#include "tests/support/temporary_directory.h"

namespace opaline::sim {
namespace {

using namespace std::chrono_literals;
using ::testing::HasSubstr;

constexpr std::chrono::nanoseconds kTurn{33'333'333};

/// A tiny station behind a socket, served on a thread.
class RigSocketTest : public ::testing::Test {
 protected:
  void SetUp() override {
    options_ = support::tiny_rig();
    socket_ = directory_.path() / "rig.sock";
  }
  void serve() {
    rig_ = *Rig::create(options_, support::tiny_responses());
    auto made = RigServer::create(*rig_, socket_);
    ASSERT_TRUE(made) << made.error().message;
    server_ = *std::move(made);
    serving_ = std::jthread([this](std::stop_token stop) { served_ = server_->serve(1h, stop); });
  }
  void TearDown() override {
    serving_ = {};
    EXPECT_TRUE(served_);
  }
  Deadline soon() const { return std::chrono::steady_clock::now() + 5s; }

  testing::TemporaryDirectory directory_;
  std::filesystem::path socket_;
  RigOptions options_;
  std::unique_ptr<Rig> rig_;
  std::unique_ptr<RigServer> server_;
  Result<void> served_ = ok();
  std::jthread serving_;
};

TEST_F(RigSocketTest, FramesAreTheSameAsInOneProcess) {
  serve();
  RigClient client(socket_);
  SimProjector projector(client);
  SimCamera camera(client);
  ASSERT_TRUE(projector.open());
  ASSERT_TRUE(camera.open());
  EXPECT_EQ(camera.info()->width, 64);
  EXPECT_EQ(projector.info()->frame_period, kTurn);
  ASSERT_TRUE(projector.show(support::flat_pattern(options_, 7, 255), {}));
  std::this_thread::sleep_for(1ms);  // a second of the rig's time: the light has followed
  const auto far = camera.capture({kTurn, 7}, {});
  ASSERT_TRUE(far) << far.error().message;
  const auto near = Rig::create(options_, support::tiny_responses());
  SimProjector near_projector(**near);
  SimCamera near_camera(**near);
  ASSERT_TRUE(near_projector.open());
  ASSERT_TRUE(near_camera.open());
  ASSERT_TRUE(near_projector.show(support::flat_pattern(options_, 7, 255), {}));
  std::this_thread::sleep_for(1ms);
  const auto frame = near_camera.capture({kTurn, 7}, {});
  ASSERT_TRUE(frame);
  EXPECT_EQ(frame->pixels, far->pixels);
  EXPECT_EQ(frame->sha256, far->sha256);
  EXPECT_EQ(frame->exposure, far->exposure);
  EXPECT_EQ(far->pattern_id, 7u);
}

TEST_F(RigSocketTest, StatusAndTruthCanBeReadWhileAnotherDrives) {
  options_.time_factor = 1.0;
  serve();
  RigClient driving(socket_);
  SimCamera camera(driving);
  ASSERT_TRUE(camera.open());
  std::stop_source stop;
  std::jthread exposing([&] {
    EXPECT_EQ(camera.capture({8s, 0}, stop.get_token()).error().code, ErrorCode::kCancelled);
  });
  RigClient watching(socket_);
  const auto status = watching.status();
  ASSERT_TRUE(status) << status.error().message;
  EXPECT_TRUE(status->camera_open);
  EXPECT_FALSE(status->lamp_on);
  const auto truth = watching.truth();
  ASSERT_TRUE(truth) << truth.error().message;
  EXPECT_EQ(truth->patch_irradiance.size(), 16u);
  EXPECT_EQ(truth->surface_radiance.width(), 8);
  ASSERT_TRUE(watching.arm({{FaultKind::kTornFrame, 3, 1, 2}}));
  EXPECT_EQ(watching.status()->faults, (Faults{{FaultKind::kTornFrame, 3, 1, 2}}));
  stop.request_stop();
}

TEST_F(RigSocketTest, ErrorsKeepTheirCodeOnTheWay) {
  serve();
  RigClient client(socket_);
  SimCamera camera(client);
  ASSERT_TRUE(camera.open());
  EXPECT_EQ(camera.capture({100s, 0}, {}).error().code, ErrorCode::kInvalidArgument);
  EXPECT_EQ(client.expose(12345, kTurn, {}).error().code, ErrorCode::kUnavailable);
  EXPECT_EQ(client.arm({{FaultKind::kTornFrame, 0, -1, 1}}).error().code,
            ErrorCode::kInvalidArgument);
}

TEST_F(RigSocketTest, WithoutARigDevicesAreUnavailable) {
  RigClient client(socket_);
  SimCamera camera(client);
  const auto opened = camera.open();
  ASSERT_FALSE(opened);
  EXPECT_EQ(opened.error().code, ErrorCode::kUnavailable);
  EXPECT_THAT(opened.error().message, HasSubstr("rig.sock"));
}

TEST_F(RigSocketTest, ASecondRigOnTheSameSocketIsRefused) {
  serve();
  const auto second = RigServer::create(*rig_, socket_);
  ASSERT_FALSE(second);
  EXPECT_EQ(second.error().code, ErrorCode::kBusy);
  EXPECT_TRUE(RigClient(socket_).status());
}

TEST_F(RigSocketTest, ARigStartedAgainWantsItsDevicesOpened) {
  serve();
  RigClient client(socket_);
  SimCamera camera(client);
  ASSERT_TRUE(camera.open());
  serving_ = {};
  server_.reset();
  serve();
  EXPECT_EQ(camera.capture({kTurn, 0}, {}).error().code, ErrorCode::kUnavailable);
  ASSERT_TRUE(camera.open());
  EXPECT_TRUE(camera.capture({kTurn, 0}, {}));
}

TEST_F(RigSocketTest, EndsWhenAClientAsksForIt) {
  serve();
  ASSERT_TRUE(RigClient(socket_).end());
  serving_.join();
  EXPECT_TRUE(served_);
}

TEST_F(RigSocketTest, NonsenseOnTheSocketHurtsNobody) {
  serve();
  {
    const auto connection = connect_unix(socket_);
    ASSERT_TRUE(connection);
    const std::string_view garbage = "GET / HTTP/1.1\r\n\r\n";
    ASSERT_GT(::send(connection->get(), garbage.data(), garbage.size(), MSG_NOSIGNAL), 0);
    EXPECT_EQ(receive_message(connection->get(), soon(), {}).error().code, ErrorCode::kUnavailable);
  }
  for (const char* header :
       {R"({"do":"explode"})",
        R"({"do":7})",
        R"({})",
        R"({"do":"expose","session":"x"})",
        R"({"do":"dark","session":-1})",
        R"({"do":"expose","session":1.5,"exposure_ns":1})",
        R"({"do":"expose","session":1,"exposure_ns":1e30})",
        R"({"do":"arm","faults":[{"kind":"torn_frame","pattern":0,"skip":0,"count":4294967297}]})",
        R"({"do":"arm","faults":{"kind":7}})",
        R"({"do":"show","session":1,"pattern_id":1,"width":4294967305,"height":9,"channels":3})",
        R"({"do":"show","session":1,"pattern_id":1,"width":8192,"height":8192,"channels":4})",
        R"({"do":"show","session":1,"pattern_id":1,"width":9,"height":9,"channels":3})"}) {
    const auto connection = connect_unix(socket_);
    ASSERT_TRUE(connection);
    ASSERT_TRUE(send_message(connection->get(), {nlohmann::json::parse(header), {}}, soon(), {}));
    const auto reply = receive_message(connection->get(), soon(), {});
    ASSERT_TRUE(reply) << reply.error().message;
    EXPECT_EQ(check_reply(*reply).error().code, ErrorCode::kInvalidArgument) << header;
  }
  EXPECT_TRUE(RigClient(socket_).status());
}

/// The most memory this process has had, KiB.
long peak_memory() {
  rusage usage{};
  ::getrusage(RUSAGE_SELF, &usage);
  return usage.ru_maxrss;
}

TEST_F(RigSocketTest, ClaimedBytesCostNothingUntilTheyCome) {
  serve();
  const long before = peak_memory();
  std::vector<FileDescriptor> connections;
  for (int i = 0; i < 8; ++i) {  // each claims a payload of 256 MiB and sends none
    connections.push_back(*connect_unix(socket_));
    const std::string claim("\x02\0\0\0\0\0\0\x10{}", 10);
    ASSERT_EQ(::send(connections.back().get(), claim.data(), claim.size(), MSG_NOSIGNAL), 10);
  }
  EXPECT_TRUE(RigClient(socket_).status());
  std::this_thread::sleep_for(50ms);  // for the others to be read
  EXPECT_LT(peak_memory() - before, 64 << 10);
}

TEST_F(RigSocketTest, TheTruthOfManyPatchesIsReadable) {
  TransportResponses many = *support::tiny_responses();
  many.patches_x = many.patches_y = 64;
  many.patches.assign(std::size_t{64} * 64, many.patches.front());
  rig_ = *Rig::create(options_, std::make_shared<const TransportResponses>(std::move(many)));
  auto made = RigServer::create(*rig_, socket_);
  ASSERT_TRUE(made);
  server_ = *std::move(made);
  serving_ = std::jthread([this](std::stop_token stop) { served_ = server_->serve(1h, stop); });
  RigClient client(socket_);
  const auto opened = client.open_projector();
  ASSERT_TRUE(opened);
  ASSERT_TRUE(client.show(opened->session, support::flat_pattern(options_, 1, 255), {}));
  std::this_thread::sleep_for(1ms);  // a second of the rig's time: the light has followed
  const auto truth = client.truth();
  ASSERT_TRUE(truth) << truth.error().message;
  ASSERT_EQ(truth->patch_irradiance.size(), 64u * 64u);
  EXPECT_EQ(truth->patch_irradiance, rig_->truth()->patch_irradiance);
  EXPECT_GT(truth->patch_irradiance[2000][1], 0.0);
  EXPECT_EQ(truth->surface_radiance, rig_->truth()->surface_radiance);
}

TEST_F(RigSocketTest, AReplyThatIsTooLargeIsAnswered) {
  options_.identity = std::string(100'000, 'x');  // a header holds 64 KiB
  serve();
  const auto status = RigClient(socket_).status();
  ASSERT_FALSE(status);
  EXPECT_EQ(status.error().code, ErrorCode::kInvalidArgument);
  EXPECT_THAT(status.error().message, HasSubstr("reply"));
}

TEST_F(RigSocketTest, EndsByItselfWhenIdleAndDarkOnly) {
  rig_ = *Rig::create(options_, support::tiny_responses());
  auto server = RigServer::create(*rig_, socket_);
  ASSERT_TRUE(server);
  EXPECT_TRUE((*server)->serve(0s, {}));  // nobody ever asked, the lamp is dark
  ASSERT_TRUE(
      rig_->show(rig_->open_projector()->session, support::flat_pattern(options_, 1, 9), {}));
  std::this_thread::sleep_for(1ms);  // a second of the rig's time: the light has followed
  std::jthread serving([&](std::stop_token stop) { served_ = (*server)->serve(0s, stop); });
  EXPECT_TRUE(RigClient(socket_).status()->lamp_on);
}

/// What a job does that is killed in the middle of an exposure: started before any thread, and told when to begin.
[[noreturn]] void drive_until_killed(const std::filesystem::path& socket,
                                     const RigOptions& options,
                                     int begin,
                                     int begun) {
  char byte = 0;
  if (::read(begin, &byte, 1) != 1) ::_exit(1);
  RigClient client(socket);
  SimProjector projector(client);
  SimCamera camera(client);
  if (!projector.open() || !camera.open()) ::_exit(2);
  if (!projector.show(support::flat_pattern(options, 5, 255), {})) ::_exit(3);
  if (::write(begun, &byte, 1) != 1) ::_exit(4);
  const auto frame = camera.capture({8s, 5}, {});
  ::_exit(frame ? 5 : 6);
}

TEST_F(RigSocketTest, TheLampStaysOnWhenItsDriverIsKilledUntilAnotherDarkensIt) {
  options_.time_factor = 1.0;
  std::array<int, 2> begin{};
  std::array<int, 2> begun{};
  ASSERT_EQ(::pipe(begin.data()), 0);
  ASSERT_EQ(::pipe(begun.data()), 0);
  const pid_t driver = ::fork();
  if (driver == 0) drive_until_killed(socket_, options_, begin[0], begun[1]);
  serve();
  char byte = 'x';
  ASSERT_EQ(::write(begin[1], &byte, 1), 1);
  ASSERT_EQ(::read(begun[0], &byte, 1), 1);
  RigClient guardian(socket_);
  while (!guardian.status()->lamp_on) std::this_thread::yield();  // the latency, 50 ms
  ASSERT_EQ(::kill(driver, SIGKILL), 0);
  int how = 0;
  ASSERT_EQ(::waitpid(driver, &how, 0), driver);
  EXPECT_TRUE(WIFSIGNALED(how));
  EXPECT_TRUE(guardian.status()->lamp_on);
  EXPECT_EQ(guardian.status()->pattern_id, 5u);
  ASSERT_TRUE(guardian.dark(RigPort::kAnybody));
  EXPECT_FALSE(guardian.status()->lamp_on);
  // And the camera can be had at once by the next job.
  SimCamera next(guardian);
  ASSERT_TRUE(next.open());
  EXPECT_TRUE(next.capture({kTurn, 0}, {}));
}

}  // namespace
}  // namespace opaline::sim
