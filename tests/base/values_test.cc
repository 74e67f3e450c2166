#include <gmock/gmock.h>

#include <thread>

#include "base/block.h"
#include "base/camera_model.h"
#include "base/channel.h"
#include "base/clock.h"
#include "base/frame.h"
#include "base/result.h"
#include "base/sha256.h"

namespace opaline {
namespace {

using namespace std::chrono_literals;

TEST(Result, CarriesAnErrorOutwardsWithWhereItHappened) {
  const Result<int> failed = timeout("frame not ready after 1.2 s").in("exposure 3 of 7");
  ASSERT_FALSE(failed);
  EXPECT_EQ(failed.error().code, ErrorCode::kTimeout);
  EXPECT_EQ(failed.error().message, "exposure 3 of 7: frame not ready after 1.2 s");
}

TEST(Block, FaceRastersNameTheCellsBehindThem) {
  const Block block{4, 3, 2, 0.5, 1.0, 2.0};
  EXPECT_EQ(block.cell_behind(Face::kZMax, 2, 1), block.index(2, 1, 1));
  EXPECT_EQ(block.cell_behind(Face::kXMin, 2, 1), block.index(0, 2, 1));
  EXPECT_EQ(block.cell_behind(Face::kYMax, 3, 1), block.index(3, 2, 1));
  EXPECT_EQ(block.face_cell_centre(Face::kZMax, 2, 1), (Vec3{1.25, 1.5, 4.0}));
  EXPECT_DOUBLE_EQ(block.face_cell_area(Face::kXMin), 2.0);
}

TEST(CameraModel, RayThroughAPixelMeetsThePointThatIsSeenThere) {
  CameraModel camera{640, 480, 900.0, 910.0, 322.0, 239.0, {-0.2, 0.05, 1e-3, -2e-3, 0.01}, {}};
  camera.camera_from_sample.translation = {1.0, -2.0, 50.0};
  const Vec3 point{12.0, 9.0, 3.0};
  const Vec3 along = camera.ray_direction(camera.project(point));
  EXPECT_LT(length(cross(along, normalized(point - camera.centre()))), 1e-9);
}

TEST(CameraModel, ProjectsByBrownsFormula) {
  // r2 = 0.05, 1 + k1 r2 = 0.995; by hand from x = 0.1, y = 0.2.
  const CameraModel camera{100, 100, 100.0, 100.0, 50.0, 50.0, {-0.1, 0, 0.01, 0, 0}, {}};
  const CameraModel::Pixel pixel = camera.project({0.1, 0.2, 1.0});
  EXPECT_NEAR(pixel.x, 50.0 + 100.0 * (0.0995 + 2 * 0.01 * 0.02), 1e-12);
  EXPECT_NEAR(pixel.y, 50.0 + 100.0 * (0.199 + 0.01 * (0.05 + 0.08)), 1e-12);
}

// FIPS 180-2, appendix B.1.
TEST(Sha256, MatchesThePublishedVector) {
  const std::string abc = "abc";
  EXPECT_EQ(sha256_hex(std::as_bytes(std::span(abc))),
            "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
}

TEST(Frame, HashTellsShapesAndSamplesApart) {
  Image<std::uint16_t> a(2, 3, 1, 7);
  const Image<std::uint16_t> b(3, 2, 1, 7);
  const std::string before = frame_hash(a);
  EXPECT_NE(before, frame_hash(b));
  a.at(1, 2) = 8;
  EXPECT_NE(before, frame_hash(a));
}

TEST(Channel, IsBoundedAndWakesOnAStopRequest) {
  Channel<int> channel(1);
  EXPECT_TRUE(channel.try_push(1));
  EXPECT_FALSE(channel.try_push(2));
  EXPECT_EQ(channel.pop({}), 1);
  std::jthread consumer([&](std::stop_token stop) { EXPECT_EQ(channel.pop(stop), std::nullopt); });
  consumer.request_stop();
}

TEST(Clock, ManualTimePassesWithSleepAndScaledTimeRunsFast) {
  ManualClock manual;
  EXPECT_TRUE(manual.sleep(8s, {}));
  EXPECT_EQ(manual.now(), 8s);
  SystemClock fast(1e6);
  const auto before = fast.now();
  EXPECT_TRUE(fast.sleep(8s, {}));
  EXPECT_GE(fast.now() - before, 8s);
}

TEST(Clock, SleepEndsWhenStopped) {
  SystemClock clock;
  std::stop_source stop;
  std::jthread stopper([&] { stop.request_stop(); });
  EXPECT_FALSE(clock.sleep(1h, stop.get_token()));
}

}  // namespace
}  // namespace opaline
