// A capture kept as photographs and replayed gives the same pictures.

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <atomic>

#include "base/files.h"
#include "base/io/image_io.h"
#include "capture/sequence.h"
#include "drivers/replay/replay_camera.h"
#include "drivers/replay/replay_projector.h"
#include "tests/support/recording_files.h"
#include "tests/support/simulated_station.h"
#include "tests/support/temporary_directory.h"
#include "tests/support/tiny_capture.h"

namespace opaline::drivers {
namespace {

/// Keeps every frame of a camera as a photograph in a folder, and an index of them.
class PhotographingCamera : public Camera {
 public:
  PhotographingCamera(Camera& camera, std::filesystem::path folder)
      : camera_(camera), folder_(std::move(folder)) {}
  Result<void> open() override { return camera_.open(); }
  Result<CameraInfo> info() const override { return camera_.info(); }
  void close() noexcept override { camera_.close(); }
  Result<Frame> capture(const ExposureRequest& request, std::stop_token stop) override {
    auto frame = camera_.capture(request, std::move(stop));
    if (!frame) return frame;
    const std::string name = fmt::format("{}.tif", ++count_);
    const auto bytes = encode_image({frame->pixels, {}, {}}, ImageFormat::kTiff);
    if (!bytes) return bytes.error();
    if (auto kept = system_files().write(folder_ / name, *bytes); !kept) return kept.error();
    index_ += fmt::format("[[photograph]]\nfile = \"{}\"\npattern = \"{}\"\nexposure_s = {:.9f}\n",
                          name,
                          request.expected_name,
                          std::chrono::duration<double>(frame->exposure).count());
    return frame;
  }
  Result<void> write_index(const sim::RigOptions& rig) const {
    const std::string text = fmt::format(
        "[camera]\nwidth = {}\nheight = {}\nbit_depth = {}\n[projector]\nwidth = {}\nheight = "
        "{}\n{}",
        rig.camera.model.width,
        rig.camera.model.height,
        rig.camera.bit_depth,
        rig.projector.width,
        rig.projector.height,
        index_);
    return write_whole(system_files(), folder_ / "index.toml", text);
  }

 private:
  Camera& camera_;
  std::filesystem::path folder_;
  std::string index_;
  int count_ = 0;
};

/// Goes on by a nanosecond at each look, as time does.
class TickingClock : public ManualClock {
 public:
  std::chrono::nanoseconds now() const override {
    return ManualClock::now() + std::chrono::nanoseconds(++ticks_);
  }

 private:
  mutable std::atomic<int> ticks_ = 0;
};

TEST(ReplayCapture, GivesTheHdrPicturesOfTheCaptureThatWasPhotographed) {
  const testing::TemporaryDirectory first;
  const testing::TemporaryDirectory photographs;
  const testing::TemporaryDirectory second;
  const sim::RigOptions rig = support::tiny_rig();
  const capture::CaptureTask task = support::tiny_task(rig);
  NullSink events;

  support::TinyStation tiny(rig);
  const capture::Station station = tiny.station();
  PhotographingCamera photographing(station.camera, photographs.path());
  const auto captured = capture_session(task,
                                        {photographing, station.projector, station.clock},
                                        {first.path(), support::unsynced_files(), events},
                                        {});
  ASSERT_TRUE(captured) << captured.error().message;
  ASSERT_TRUE(photographing.write_index(rig));

  TickingClock clock;
  ReplayCamera camera(photographs.path(), clock);
  ReplayProjector projector(photographs.path());
  const auto replayed = capture_session(
      task, {camera, projector, clock}, {second.path(), support::unsynced_files(), events}, {});
  ASSERT_TRUE(replayed) << replayed.error().message;
  EXPECT_EQ(replayed->lights, captured->lights);
  const auto expected = support::files_below(first.path() / "hdr");
  EXPECT_FALSE(expected.empty());
  EXPECT_EQ(support::files_below(second.path() / "hdr"), expected);
}

}  // namespace
}  // namespace opaline::drivers
