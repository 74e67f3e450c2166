#include "base/event_log.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <fstream>
#include <thread>

#include "tests/support/recording_files.h"
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

TEST_F(EventLogTest, CutsATailInWhichOnlyProgressStandsBehindTheDamage) {
  auto log = open();
  log->append("a", {{"value", 1}}).value();
  for (int i = 0; i < 3; ++i) {
    log->append("progress", {{"i", i}}, EventLog::Durability::kRelaxed).value();
  }
  std::string damaged = text();
  const std::size_t hole = damaged.find(R"("i":0)");
  damaged.replace(hole, 5, 5, '\0');  // a page that had not reached the disk
  replace_with(damaged);

  EXPECT_EQ(read_events(path_)->events.size(), 1U);
  EXPECT_EQ(open()->append("b", {}).value(), 2U);
  ASSERT_EQ(read_events(path_)->events.size(), 2U);
  EXPECT_EQ(read_events(path_)->events.back().type, "b");
}

TEST_F(EventLogTest, RefusesALogWithAFactMissing) {
  auto log = open();
  for (const char* type : {"a", "b", "c"}) log->append(type, {}).value();
  std::string text = this->text();
  const std::size_t second = text.find('\n') + 1;
  replace_with(text.erase(second, text.find('\n', second) + 1 - second));
  const auto batch = read_events(path_);
  ASSERT_FALSE(batch);
  EXPECT_THAT(batch.error().message, HasSubstr("entry 2"));
}

TEST_F(EventLogTest, ReadsALogOfAnyLengthAndLinesOverManyChunks) {
  auto log = open();
  for (int i = 0; i < 20; ++i) log->append("a", {{"text", std::string(100'000, 'x')}}).value();
  log.reset();
  // A tail of one endless line, longer than any entry may be.
  std::filesystem::resize_file(path_, std::filesystem::file_size(path_) + (300u << 20));
  std::size_t seen = 0;
  const auto end = scan_events(path_, 0, [&](const Event& event) { seen = event.seq; });
  ASSERT_TRUE(end) << end.error().message;
  EXPECT_EQ(seen, 20U);
  EXPECT_EQ(open()->append("b", {}).value(), 21U);
  EXPECT_LT(std::filesystem::file_size(path_), 3u << 20);
  const auto refused = open()->append("b", {{"text", std::string(17u << 20, 'x')}});
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::kInvalidArgument);
}

TEST_F(EventLogTest, MakesItsNameDurableThoughTheFirstEntryIsNot) {
  support::RecordingFiles files(directory_.path());
  auto log = *EventLog::open(files, path_);
  log->append("progress", {}, EventLog::Durability::kRelaxed).value();
  log->append("a", {}).value();
  const auto operations = files.operations();
  EXPECT_EQ(
      std::ranges::count(
          operations, support::FileOperation::Kind::kSyncDirectory, &support::FileOperation::kind),
      1);
}

TEST_F(EventLogTest, StillTellsTheEndOnAFullDisk) {
  support::FullDisk full(50'000);
  auto log = *EventLog::open(full, path_);
  log->append("job.started", {}).value();
  while (full.write(directory_.path() / "frame", std::vector<std::byte>(1000))) {
  }
  int progresses = 0;
  while (log->append("progress", {{"step", "capture"}}, EventLog::Durability::kRelaxed)) {
    ASSERT_LT(++progresses, 1000);
  }
  const auto end = log->append("job.finished", {{"message", std::string(4000, 'x')}});
  ASSERT_TRUE(end) << end.error().message;
  EXPECT_EQ(read_events(path_)->events.back().type, "job.finished");
}

}  // namespace
}  // namespace opaline
