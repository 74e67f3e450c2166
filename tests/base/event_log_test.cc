#include "base/event_log.h"

#include <gmock/gmock.h>

#include <fstream>
#include <thread>

#include "tests/support/temporary_directory.h"

namespace opaline {
namespace {

using ::testing::HasSubstr;

class EventLogTest : public ::testing::Test {
 protected:
  std::unique_ptr<EventLog> open() {
    auto log = EventLog::open(system_files(), path_);
    EXPECT_TRUE(log) << (log ? "" : log.error().message);
    return std::move(*log);
  }
  std::string text() { return read_text(path_).value(); }
  void replace_with(const std::string& text) { std::ofstream(path_, std::ios::binary) << text; }

  testing::TemporaryDirectory directory_;
  std::filesystem::path path_ = directory_.path() / "events.jsonl";
};

TEST_F(EventLogTest, NumbersItsEntriesOnAcrossReopening) {
  EXPECT_EQ(open()->append("session.created", {{"name", "a"}}).value(), 1U);
  EXPECT_EQ(open()->append("job.started", {{"job", "capture"}}).value(), 2U);

  const EventBatch batch = read_events(path_).value();
  ASSERT_EQ(batch.events.size(), 2U);
  EXPECT_EQ(batch.events[1].type, "job.started");
  EXPECT_EQ(batch.events[1].data["job"], "capture");
}

TEST_F(EventLogTest, DropsATailTornAtAnyByteAndGoesOnNumberingFromTheLastIntactEntry) {
  open()->append("a", {{"text", "first"}}).value();
  const std::size_t first = text().size();
  open()->append("b", {{"text", "second"}}).value();
  const std::string whole = text();

  for (std::size_t cut = first; cut < whole.size(); ++cut) {
    replace_with(whole.substr(0, cut));
    EXPECT_EQ(read_events(path_)->events.size(), 1U) << cut;
    EXPECT_EQ(open()->append("c", {}).value(), 2U) << cut;
    EXPECT_EQ(read_events(path_)->events.back().type, "c") << cut;
  }
}

TEST_F(EventLogTest, RefusesALogWithADamagedEntryBeforeIntactOnes) {
  auto log = open();
  log->append("a", {{"value", 1}}).value();
  log->append("b", {{"value", 2}}).value();
  std::string damaged = text();
  damaged[damaged.find("value") + 7] = '7';
  replace_with(damaged);

  const auto batch = read_events(path_);
  ASSERT_FALSE(batch);
  EXPECT_THAT(batch.error().message, HasSubstr("entry 1"));
}

TEST_F(EventLogTest, IsReadOnFromAnOffsetWhileItGrows) {
  auto log = open();
  log->append("a", {}).value();
  const EventBatch before = read_events(path_).value();
  log->append("b", {}, EventLog::Durability::kRelaxed).value();

  const EventBatch after = read_events(path_, before.next_offset).value();
  ASSERT_EQ(after.events.size(), 1U);
  EXPECT_EQ(after.events[0].seq, 2U);
}

TEST_F(EventLogTest, KeepsOneSequenceWhenThreadsAppendAtOnce) {
  auto log = open();
  const auto append_fifty = [&] {
    for (int i = 0; i < 50; ++i)
      log->append("x", {{"i", i}}, EventLog::Durability::kRelaxed).value();
  };
  {
    std::jthread one(append_fifty);
    std::jthread two(append_fifty);
  }
  const EventBatch batch = read_events(path_).value();
  ASSERT_EQ(batch.events.size(), 100U);
  for (std::size_t i = 0; i < 100; ++i) EXPECT_EQ(batch.events[i].seq, i + 1);
}

}  // namespace
}  // namespace opaline
