#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "tests/support/recording_files.h"
#include "tests/support/simulated_station.h"
#include "tests/support/temporary_directory.h"
#include "tests/support/tiny_capture.h"

namespace opaline::capture {

using Files = std::vector<std::pair<std::string, std::vector<std::byte>>>;

/// What must be equal whatever happened on the way: HDR pictures and the dataset.
inline Files results_of(const std::filesystem::path& directory) {
  Files files = support::files_below(directory / "hdr");
  for (const char* name : {"dataset.exr", "dataset_light.exr", "dataset.json"}) {
    auto bytes = read_bytes(directory / name, 1u << 30);
    files.emplace_back(name, bytes ? *std::move(bytes) : std::vector<std::byte>{});
  }
  return files;
}

/// A session captured by the tiny station, in a directory of its own.
class SequenceTest : public ::testing::Test {
 protected:
  Result<CaptureSummary> run(const std::filesystem::path& directory, std::stop_token stop = {}) {
    return run(directory, support::unsynced_files(), std::move(stop));
  }
  Result<CaptureSummary> run(const std::filesystem::path& directory,
                             FileOperations& files,
                             std::stop_token stop = {}) {
    events_ = std::make_unique<support::RecordingSink>();
    return run(directory, files, *events_, std::move(stop));
  }
  Result<CaptureSummary> run(const std::filesystem::path& directory,
                             FileOperations& files,
                             EventSink& events,
                             std::stop_token stop) {
    support::TinyStation tiny(options_);
    const Workplace workplace{directory, files, events, free_bytes_};
    auto summary = capture_session(task_, tiny.station(), workplace, stop);
    lamp_on_ = tiny.rig().status()->lamp_on;
    exposures_ = tiny.rig().status()->exposures;
    return summary;
  }
  /// An undisturbed run's results, taken once for all tests.
  static const Files& undisturbed() {
    static const Files files = [] {
      const testing::TemporaryDirectory dir;
      support::TinyStation tiny(support::tiny_rig());
      NullSink events;
      const auto task = support::tiny_task(support::tiny_rig());
      const auto done = capture_session(
          task, tiny.station(), {dir.path(), support::unsynced_files(), events}, {});
      EXPECT_TRUE(done) << done.error().message;
      return results_of(dir.path());
    }();
    return files;
  }
  void expect_recovers_from(sim::Faults faults, const std::string& fault) {
    expect_one_retake(std::move(faults), fault);
    EXPECT_EQ(results_of(dir_.path()), undisturbed());
  }
  void expect_one_retake(sim::Faults faults, const std::string& fault) {
    options_.faults = std::move(faults);
    const auto summary = run(dir_.path());
    ASSERT_TRUE(summary) << summary.error().message;
    EXPECT_EQ(summary->retaken, 1);
    const auto retaken = events_->facts("region.retaken");
    ASSERT_EQ(retaken.size(), 1u);
    EXPECT_EQ(retaken[0]["fault"], fault) << retaken[0].dump();
  }

  testing::TemporaryDirectory dir_;
  sim::RigOptions options_ = support::tiny_rig();
  CaptureTask task_ = support::tiny_task(options_);
  std::unique_ptr<support::RecordingSink> events_;
  std::function<Result<std::uint64_t>(const std::filesystem::path&)> free_bytes_;
  bool lamp_on_ = true;
  std::uint64_t exposures_ = 0;
};

}  // namespace opaline::capture
