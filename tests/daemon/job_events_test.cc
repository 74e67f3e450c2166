#include "daemon/jobs/job_events.h"

#include <gtest/gtest.h>

#include <thread>
#include <vector>

#include "tests/support/temporary_directory.h"

namespace opaline::daemon {
namespace {

class JobEventsTest : public ::testing::Test {
 protected:
  std::vector<Event> written() const { return read_events(path_)->events; }

  testing::TemporaryDirectory root_;
  std::filesystem::path path_ = root_.path() / "events.jsonl";
  std::unique_ptr<EventLog> log_ = *EventLog::open(system_files(), path_);
  ManualClock clock_;
  JobEvents events_{*log_, clock_};
};

TEST_F(JobEventsTest, WritesProgressAtMostFiveTimesASecond) {
  for (int i = 0; i < 1000; ++i) {
    events_.progress({"capture", i / 1000.0, std::nullopt, {}});
    clock_.advance(std::chrono::milliseconds(1));
  }
  EXPECT_EQ(written().size(), 5U);
  EXPECT_EQ(events_.latest_progress()["fraction"], 0.999);
}

TEST_F(JobEventsTest, WritesTheFirstOfEachStepAtOnce) {
  events_.progress({"one", 1.0, std::nullopt, {}});
  events_.progress({"two", 0.0, 3.5, {{"region", 7}}});

  ASSERT_EQ(written().size(), 2U);
  EXPECT_EQ(written()[1].data["step"], "two");
  EXPECT_EQ(written()[1].data["seconds_left"], 3.5);
  EXPECT_EQ(written()[1].data["detail"]["region"], 7);
}

TEST_F(JobEventsTest, TakesFactsAndProgressFromManyThreads) {
  {
    std::vector<std::jthread> threads;
    for (int t = 0; t < 4; ++t) {
      threads.emplace_back([this] {
        for (int i = 0; i < 20; ++i) {
          events_.progress({"step", 0.5, std::nullopt, {}});
          ASSERT_TRUE(events_.fact("a.fact", {{"i", i}}));
        }
      });
    }
  }
  const std::vector<Event> events = written();
  EXPECT_EQ(events.size(), 81U);  // 80 facts and one progress: the clock stands still
  for (std::size_t i = 0; i < events.size(); ++i) EXPECT_EQ(events[i].seq, i + 1);
}

}  // namespace
}  // namespace opaline::daemon
