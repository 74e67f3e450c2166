#include "daemon/jobs/guardian.h"

#include <gmock/gmock.h>

#include <chrono>
#include <csignal>
#include <fstream>
#include <string>

#include "base/event_log.h"
#include "bench/faults/fault_bed.h"
#include "sim/rig_client.h"
#include "tests/support/named_directory.h"
#include "tests/support/process.h"

namespace opaline::faults {
namespace {

using namespace std::chrono_literals;
using testing::eventually;
using ::testing::HasSubstr;

// The child of `parent` that runs opaline-guardian; 0 when there is none.
pid_t guardian_of(pid_t parent) {
  const std::string number = std::to_string(parent);
  std::ifstream children("/proc/" + number + "/task/" + number + "/children");
  for (pid_t child = 0; children >> child;) {
    std::string name;
    std::ifstream("/proc/" + std::to_string(child) + "/comm") >> name;
    if (name.starts_with("opaline-guardia")) return child;  // of which the kernel keeps 15
  }
  return 0;
}

TEST(CaptureAndItsGuardian, StopWithTheLampDarkWhenTheGuardianDies) {
  auto bed = FaultBed::create(
      {.programs = opaline::testing::named_directory("OPALINE_BIN_DIR"), .time_factor = 1});
  ASSERT_TRUE(bed) << bed.error().message;
  const auto session = (*bed)->new_session();
  ASSERT_TRUE(session);
  const auto job = (*bed)->start("opaline-capture", *session);
  ASSERT_TRUE(job) << job.error().message;
  const auto lamp_on = [&] {
    const auto status = sim::RigClient((*bed)->rig_socket()).status();
    return status && status->lamp_on;
  };
  ASSERT_TRUE(eventually(lamp_on, 60s)) << "the capture shows no light";
  const pid_t guardian = guardian_of((*job)->pid());
  ASSERT_GT(guardian, 0);

  ASSERT_EQ(::kill(guardian, SIGKILL), 0);

  EXPECT_TRUE(eventually([&] { return !lamp_on(); }, 2s));
  const auto status = (*job)->wait(20s);
  ASSERT_TRUE(status) << status.error().message;
  EXPECT_EQ(*status, 1);
  const auto events = read_events(*session / "events.jsonl");
  ASSERT_TRUE(events);
  EXPECT_THAT(events->events.back().data.dump(), HasSubstr("the guardian died"));
}

}  // namespace
}  // namespace opaline::faults
