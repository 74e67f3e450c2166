#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <random>

#include "base/event_log.h"
#include "capture/sequence.h"
#include "tests/support/recording_files.h"
#include "tests/support/simulated_station.h"
#include "tests/support/temporary_directory.h"
#include "tests/support/tiny_capture.h"

namespace opaline::capture {
namespace {

namespace fs = std::filesystem;
using support::FileOperation;

constexpr int kPrefixes = 48;

CaptureTask task() {
  CaptureTask task = support::tiny_task(support::tiny_rig());
  task.options.patterns.held_out_lights = 2;
  return task;
}

Result<CaptureSummary> run(FileOperations& files, const fs::path& directory) {
  const auto log = EventLog::open(files, directory / "events.jsonl");
  if (!log) return log.error();
  support::LogSink events(**log);  // its writes are recorded like all others
  support::TinyStation tiny(support::tiny_rig());
  return capture_session(task(), tiny.station(), {directory, files, events}, {});
}

std::vector<std::pair<std::string, std::vector<std::byte>>> results_of(const fs::path& directory) {
  auto results = support::files_below(directory / "hdr");
  for (const char* name : {"dataset.exr", "dataset_light.exr", "dataset.json"}) {
    const auto bytes = read_bytes(directory / name, 1u << 30);
    EXPECT_TRUE(bytes) << bytes.error().message;
    if (bytes) results.emplace_back(name, *bytes);
  }
  return results;
}

// Lights whose index had reached the disk, so that they must not be taken again.
int safe_lights(std::span<const FileOperation> operations) {
  std::map<fs::path, bool> safe;  // directory -> synced since the index got its name
  for (const FileOperation& o : operations) {
    if (o.kind == FileOperation::Kind::kRename && o.to.filename() == "index.json") {
      safe[o.to.parent_path()] = false;
    }
    if (o.kind == FileOperation::Kind::kSyncDirectory && safe.contains(o.path)) safe[o.path] = true;
  }
  safe.erase("frames/black");
  return static_cast<int>(std::ranges::count_if(safe, [](const auto& s) { return s.second; }));
}

TEST(PowerLoss, LosesAtMostTheLightInFlightWhereverItStrikes) {
  const testing::TemporaryDirectory undisturbed;
  support::RecordingFiles recorder(undisturbed.path());
  const auto first = run(recorder, undisturbed.path());
  ASSERT_TRUE(first) << first.error().message;
  const auto expected = results_of(undisturbed.path());
  const auto operations = recorder.operations();
  std::mt19937_64 random(20240615);
  for (int i = 0; i < kPrefixes; ++i) {
    const std::size_t length = random() % (operations.size() + 1);
    const auto prefix = std::span(operations).first(length);
    const testing::TemporaryDirectory dir;
    support::replay_power_loss(prefix, random(), dir.path());
    const auto again = run(support::unsynced_files(), dir.path());
    ASSERT_TRUE(again) << "after " << length << " operations: " << again.error().message;
    EXPECT_LE(again->taken, first->taken - safe_lights(prefix)) << "after " << length;
    ASSERT_EQ(results_of(dir.path()), expected) << "after " << length << " operations";
  }
}

}  // namespace
}  // namespace opaline::capture
