#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>

#include "base/event_log.h"
#include "bench/faults/fault_bed.h"
#include "tests/support/named_directory.h"

namespace opaline::faults {
namespace {

constexpr int kKills = 8;
constexpr int kLights = 6;  // 2 x 2 regions and two held-out ones

std::filesystem::path programs() { return opaline::testing::named_directory("OPALINE_BIN_DIR"); }

/// How often a light was taken to its end.
std::ptrdiff_t captured(const std::filesystem::path& session) {
  const auto log = read_events(session / "events.jsonl");
  EXPECT_TRUE(log) << log.error().message;
  return log ? std::ranges::count(log->events, "region.captured", &Event::type) : 0;
}

TEST(KilledCapture, CompletesWithTheSameBytesAsAnUndisturbedOne) {
  const auto bed = FaultBed::create({programs()});
  ASSERT_TRUE(bed) << bed.error().message;
  const auto reference = (*bed)->new_session();
  ASSERT_TRUE(reference) << reference.error().message;
  const auto first = (*bed)->complete("opaline-capture", *reference);  // starts the rig as well
  ASSERT_TRUE(first) << first.error().message;
  const auto expected = capture_results(*reference);
  ASSERT_TRUE(expected) << expected.error().message;
  EXPECT_EQ(expected->size(), kLights + 3U);

  const auto timed = (*bed)->new_session();
  const auto start = std::chrono::steady_clock::now();
  ASSERT_TRUE((*bed)->complete("opaline-capture", *timed));
  const auto length = std::chrono::steady_clock::now() - start;
  int alive = 0;
  for (const auto at : moments(length, kKills, 7)) {
    const auto session = (*bed)->new_session();
    ASSERT_TRUE(session);
    const auto killed = (*bed)->kill_and_complete("opaline-capture", *session, at);
    ASSERT_TRUE(killed) << killed.error().message;
    alive += *killed ? 1 : 0;
    const auto files = capture_results(*session);
    ASSERT_TRUE(files) << files.error().message;
    EXPECT_EQ(*files, *expected) << "killed after " << at.count() / 1'000'000 << " ms";
    // What has been saved is not taken again: only the light that the kill met is redone. Killed just after saving, a
    // light goes without its entry.
    EXPECT_LE(captured(*session), kLights);
    EXPECT_GE(captured(*session), kLights - 1);
  }
  EXPECT_GE(alive, kKills / 2);  // the machine may be slower or quicker from run to run
}

}  // namespace
}  // namespace opaline::faults
