// A capture kept as photographs and replayed gives the same pictures.

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <atomic>

#include "base/files.h"
#include "base/io/image_io.h"
#include "capture/sequence.h"
#include "drivers/replay/replay_camera.h"
#include "drivers/replay/replay_projector.h"
#include "tests/support/dng_file.h"
#include "tests/support/recording_files.h"
#include "tests/support/simulated_station.h"
#include "tests/support/temporary_directory.h"
#include "tests/support/tiny_capture.h"

namespace opaline::drivers {
namespace {

using Encode = Result<std::vector<std::byte>> (*)(const Image<std::uint16_t>& pixels);

Result<std::vector<std::byte>> as_tiff(const Image<std::uint16_t>& pixels) {
  return encode_image({pixels, {}, {}}, ImageFormat::kTiff);
}
/// A mosaic of twice as many columns and rows, both greens alike.
Result<std::vector<std::byte>> as_dng(const Image<std::uint16_t>& pixels) {
  support::DngOptions options{.width = 2 * pixels.width(), .height = 2 * pixels.height()};
  for (int y = 0; y < options.height; ++y)
    for (int x = 0; x < options.width; ++x)
      options.codes.push_back(pixels.at(x / 2, y / 2, x % 2 + y % 2));
  return support::make_dng(options);
}

/// Keeps every frame of a camera as a photograph in a folder, and an index of them.
class PhotographingCamera : public Camera {
 public:
  PhotographingCamera(Camera& camera, std::filesystem::path folder, Encode encode)
      : camera_(camera), folder_(std::move(folder)), encode_(encode) {}
  Result<void> open() override { return camera_.open(); }
  Result<CameraInfo> info() const override { return camera_.info(); }
  void close() noexcept override { camera_.close(); }
  Result<Frame> capture(const ExposureRequest& request, std::stop_token stop) override {
    auto frame = camera_.capture(request, std::move(stop));
    if (!frame) return frame;
    const std::string name = fmt::format("{}.photograph", ++count_);
    const auto bytes = encode_(frame->pixels);
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
  Encode encode_;
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

void expect_same_pictures(Encode encode) {
  const testing::TemporaryDirectory first;
  const testing::TemporaryDirectory photographs;
  const testing::TemporaryDirectory second;
  const sim::RigOptions rig = support::tiny_rig();
  const capture::CaptureTask task = support::tiny_task(rig);
  NullSink events;

  support::TinyStation tiny(rig);
  const capture::Station station = tiny.station();
  PhotographingCamera photographing(station.camera, photographs.path(), encode);
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
  EXPECT_TRUE(support::files_below(second.path() / "hdr") == expected);
}

TEST(ReplayCapture, GivesTheHdrPicturesOfTheCaptureThatWasPhotographed) {
  expect_same_pictures(as_tiff);
}
TEST(ReplayCapture, GivesThemFromRawPhotographsToo) { expect_same_pictures(as_dng); }

}  // namespace
}  // namespace opaline::drivers
