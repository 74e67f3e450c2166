#include "daemon/jobs/guardian.h"

#include <gmock/gmock.h>

#include <chrono>
#include <csignal>

#include "base/event_log.h"
#include "base/lock.h"
#include "bench/faults/fault_bed.h"
#include "sim/rig_client.h"
#include "tests/support/named_directory.h"
#include "tests/support/process.h"

namespace opaline::faults {
namespace {

using namespace std::chrono_literals;
using testing::eventually;

std::filesystem::path programs() { return opaline::testing::named_directory("OPALINE_BIN_DIR"); }

/// A capture at work in real time, its lamp on.
class GuardedCapture : public ::testing::Test {
 protected:
  void SetUp() override {
    auto made = FaultBed::create({.programs = programs(), .time_factor = 1});
    ASSERT_TRUE(made) << made.error().message;
    bed_ = *std::move(made);
    session_ = *bed_->new_session();
    auto job = bed_->start("opaline-capture", session_);
    ASSERT_TRUE(job) << job.error().message;
    job_ = *std::move(job);
    ASSERT_TRUE(eventually([this] { return lamp_on(); }, 60s)) << "the capture shows no light";
  }
  bool lamp_on() const {
    const auto status = sim::RigClient(bed_->rig_socket()).status();
    return status && status->lamp_on;
  }

  std::unique_ptr<FaultBed> bed_;
  std::filesystem::path session_;
  std::unique_ptr<JobProcess> job_;
};

TEST_F(GuardedCapture, LeavesTheLampDarkWithinASecondOfBeingKilled) {
  job_->kill();
  EXPECT_TRUE(eventually([this] { return !lamp_on(); }, 1s));
}

TEST_F(GuardedCapture, LeavesTheLampDarkWhenTerminated) {
  ::kill(job_->pid(), SIGTERM);
  EXPECT_TRUE(eventually([this] { return !lamp_on(); }, 1s));
  const auto status = job_->wait(20s);
  ASSERT_TRUE(status) << status.error().message;
  EXPECT_EQ(*status, 3);
}

TEST_F(GuardedCapture, HoldsTheStationAgainstASecondSession) {
  const auto second = bed_->new_session();
  const auto job = bed_->start("opaline-capture", *second);
  ASSERT_TRUE(job);
  const auto status = (*job)->wait(60s);
  ASSERT_TRUE(status) << status.error().message;
  EXPECT_EQ(*status, 4);  // busy
  EXPECT_TRUE(lamp_on());
}

TEST(Guardian, RefusesToDoWithoutItsProgram) {
  const auto guardian = daemon::Guardian::start("/nonexistent/opaline-guardian", "/tmp", {});
  ASSERT_FALSE(guardian);
  EXPECT_THAT(guardian.error().message, ::testing::HasSubstr("no light is switched on"));
}

TEST(Guardian, RefusesAGuardianThatEndsAtOnce) {
  const auto guardian = daemon::Guardian::start("/bin/true", "/tmp", {});
  ASSERT_FALSE(guardian);
  EXPECT_EQ(guardian.error().code, ErrorCode::kUnavailable);
}

TEST(Guardian, StopsWaitingWhenAsked) {
  std::stop_source stop;
  stop.request_stop();
  const auto guardian = daemon::Guardian::start("/bin/cat", "/dev/tty", stop.get_token());
  EXPECT_FALSE(guardian);
}

}  // namespace
}  // namespace opaline::faults
