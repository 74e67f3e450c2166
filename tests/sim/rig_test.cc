#include "sim/rig.h"

#include <gmock/gmock.h>

#include <chrono>
#include <cmath>
#include <thread>

#include "sim/light_transport.h"
#include "sim/scene.h"
#include "tests/support/running_rig.h"

namespace opaline::sim {
namespace {

using namespace std::chrono_literals;
using std::chrono::nanoseconds;

TEST_F(RigTest, LightGrowsInProportionToTheExposure) {
  options_.camera.dark_electrons_per_second = 0.0;
  build(options_);
  show(1, 128);
  const double one = middle(take(kTurn), 0);
  const double four = middle(take(4 * kTurn), 0);
  // Shot noise of the means: about 330 electrons a pixel over 576 pixels in the shorter one, four
  // sigma.
  const double electrons = one * 2.5 * 576.0;
  EXPECT_NEAR(four / one, 4.0, 4.0 * 4.0 * std::sqrt(1.25 / electrons));
}

TEST_F(RigTest, ClipsWhenOverexposed) {
  show(1, 255);
  const Frame frame = take(8s);
  EXPECT_EQ(frame.pixels.at(32, 32, 0), 4095);
}

TEST_F(RigTest, ExposuresOfPartOfATurnAreWrongByTheWheel) {
  show(1, 255);
  const Frame whole = take(kTurn);
  const Frame part = take(kTurn / 3);
  double worst = 0.0;
  for (int c = 0; c < 3; ++c) {
    worst = std::max(worst, std::abs(3.0 * middle(part, c) / middle(whole, c) - 1.0));
  }
  EXPECT_GT(worst, 0.3);
}

TEST_F(RigTest, TheSameRequestGivesTheSamePixelsWheneverItIsMade) {
  show(3, 200);
  const Frame first = take(2 * kTurn);
  show(4, 100);
  take(kTurn);
  clock_.advance(17ms);
  show(3, 200);
  const Frame again = take(2 * kTurn);
  EXPECT_EQ(first.pixels, again.pixels);
  EXPECT_EQ(first.exposure, again.exposure);
  EXPECT_EQ(first.sha256, again.sha256);
  build(options_);  // another process would see the same
  show(3, 200);
  EXPECT_EQ(take(2 * kTurn).sha256, first.sha256);
}

TEST_F(RigTest, NoiseDiffersBetweenSeedsPatternsAndExposures) {
  show(3, 200);
  const Frame frame = take(2 * kTurn);
  EXPECT_NE(take(3 * kTurn).pixels, frame.pixels);
  show(4, 200);
  EXPECT_NE(take(2 * kTurn).pixels, frame.pixels);
  options_.seed = 2;
  build(options_);
  show(3, 200);
  EXPECT_NE(take(2 * kTurn).pixels, frame.pixels);
}

TEST_F(RigTest, FrameSaysWhatItIs) {
  show(9, 255);
  const nanoseconds before = clock_.now();
  const Frame frame = take(kTurn);
  EXPECT_EQ(frame.pattern_id, 9u);
  EXPECT_EQ(frame.trigger_count, 1u);
  EXPECT_EQ(frame.start, before);
  EXPECT_EQ(frame.sha256, frame_hash(frame.pixels));
  EXPECT_NE(frame.exposure, kTurn);
  EXPECT_NEAR(static_cast<double>(frame.exposure.count()) / kTurn.count(), 1.0, 3.01e-4);
  EXPECT_EQ(take(kTurn).trigger_count, 2u);
}

TEST_F(RigTest, AnExposureBeforeTheLightFollowsShowsTheOldPattern) {
  show(1, 255);
  ASSERT_TRUE(projector_->show(support::flat_pattern(options_, 2, 0), {}));
  const Frame early = take(kTurn);  // shorter than the latency of 50 ms
  EXPECT_EQ(early.pattern_id, 1u);
  EXPECT_GT(middle(early, 0), 50.0);
  const Frame across = take(kTurn);
  EXPECT_EQ(across.pattern_id, 0u);
  const Frame late = take(kTurn);
  EXPECT_EQ(late.pattern_id, 2u);
  EXPECT_LT(middle(late, 0), 5.0);
}

TEST_F(RigTest, BlackPatternStillLeaksTheProjectorsBlackLevel) {
  options_.camera.read_noise_electrons = 0.5;
  options_.camera.dark_electrons_per_second = 0.0;
  options_.projector.black_level = 0.01;
  build(options_);
  show(1, 0);
  const double leak = middle(take(60 * kTurn), 0);
  show(2, 255);
  const double full = middle(take(kTurn), 0) * 60.0;
  EXPECT_NEAR(
      leak / full, 0.01, 0.0005);  // 5 % : shot noise of about 33 codes over 576 pixels is 0.3 %
  ASSERT_TRUE(projector_->dark());
  EXPECT_NEAR(middle(take(60 * kTurn), 0), 0.0, 0.1);
}

TEST_F(RigTest, TruthSaysWhatShines) {
  show(5, 255);
  const auto truth = rig_->truth();
  ASSERT_TRUE(truth);
  EXPECT_EQ(truth->pattern_id, 5u);
  EXPECT_EQ(truth->scene, R"({"kind":"hills"})");
  ASSERT_EQ(truth->patch_irradiance.size(), 16u);
  EXPECT_NEAR(truth->patch_irradiance[5][0], 1e-3, 3e-5);  // vignetting near the middle
  EXPECT_GT(truth->surface_radiance.at(4, 4, 0), 1e-5f);
}

TEST_F(RigTest, AnEightSecondExposureTakesAsLongAsTheTimeFactorSays) {
  auto made = Rig::create(options_, support::tiny_responses());  // factor 1000, its own clock
  ASSERT_TRUE(made);
  SimCamera camera(**made);
  ASSERT_TRUE(camera.open());
  const auto start = std::chrono::steady_clock::now();
  const auto frame = camera.capture({8s, 0}, {});
  const auto took = std::chrono::steady_clock::now() - start;
  ASSERT_TRUE(frame) << frame.error().message;
  EXPECT_GE(took, 7990us);  // the measured exposure may be 3e-4 shorter
  EXPECT_LT(took, 4s);      // a loaded machine
}

TEST_F(RigTest, OpeningTakesTheDeviceFromWhoeverHadIt) {
  SimCamera other(*rig_);
  ASSERT_TRUE(other.open());
  const auto refused = try_take();
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::kUnavailable);
  EXPECT_TRUE(other.capture({kTurn, 0}, {}));
}

TEST_F(RigTest, OpeningTakesTheDeviceFromAnExposureUnderWay) {
  options_.time_factor = 1.0;
  auto made = Rig::create(options_, support::tiny_responses());  // in real time
  ASSERT_TRUE(made);
  SimCamera camera(**made);
  ASSERT_TRUE(camera.open());
  Result<Frame> frame = Frame{};
  const auto start = std::chrono::steady_clock::now();
  {
    std::jthread exposing([&] { frame = camera.capture({8s, 0}, {}); });
    std::this_thread::sleep_for(20ms);
    SimCamera other(**made);
    ASSERT_TRUE(other.open());
    exposing.join();
    EXPECT_TRUE(other.info());
  }
  EXPECT_LT(std::chrono::steady_clock::now() - start, 4s);  // woken, and a busy machine
  ASSERT_FALSE(frame);
  EXPECT_EQ(frame.error().code, ErrorCode::kUnavailable);  // nobody asked it to stop
  EXPECT_FALSE(camera.info());
}

TEST_F(RigTest, NobodysSessionExposesNothing) {
  const auto frame = rig_->expose(0, kTurn, {});
  ASSERT_FALSE(frame);
  EXPECT_EQ(frame.error().code, ErrorCode::kUnavailable);
}

TEST_F(RigTest, ResponsesThatDoNotFitAreRefused) {
  auto responses = *support::tiny_responses();
  responses.patches.pop_back();
  EXPECT_FALSE(Rig::create(options_, std::make_shared<TransportResponses>(responses)));
  responses = *support::tiny_responses();
  responses.block.nx = 9;
  EXPECT_FALSE(Rig::create(options_, std::make_shared<TransportResponses>(responses)));
  responses = *support::tiny_responses();
  responses.camera_centre.x += 5.0;
  const auto elsewhere = Rig::create(options_, std::make_shared<TransportResponses>(responses));
  ASSERT_FALSE(elsewhere);
  EXPECT_THAT(elsewhere.error().message, ::testing::HasSubstr("5.0 mm away"));
}

TEST_F(RigTest, ALitPatchIsSeenWhereItIsFromBehindAndFromInFront) {
  const Block block = support::tiny_responses()->block;
  const auto material =
      make_material({.kind = SceneKind::kHomogeneous, .block = block, .reduced_scattering = 2.0});
  ASSERT_TRUE(material) << material.error().message;
  for (const Face lit : {Face::kZMin, Face::kZMax}) {
    NullSink nobody;
    const auto computed = compute_responses(*material,
                                            {.lit_face = lit,
                                             .patches_x = 2,
                                             .patches_y = 2,
                                             .camera_centre = {4.0, 4.0, 104.0},
                                             .photons_per_patch = 1},
                                            "",
                                            nobody,
                                            {});
    ASSERT_TRUE(computed);
    auto made =
        Rig::create(options_, std::make_shared<const TransportResponses>(*computed), &clock_);
    ASSERT_TRUE(made) << made.error().message;
    SimCamera camera(**made);
    SimProjector projector(**made);
    ASSERT_TRUE(camera.open());
    ASSERT_TRUE(projector.open());
    // The face is 40 pixels wide from (20, 10) on; its right half, of the upper rows, is patch (1, 0).
    drivers::Pattern pattern = support::flat_pattern(options_, 1, 0);
    for (int y = 10; y < 30; ++y) {
      for (int x = 40; x < 60; ++x) {
        for (int c = 0; c < 3; ++c) pattern.codes.at(x, y, c) = 255;
      }
    }
    ASSERT_TRUE(projector.show(pattern, {}));
    clock_.sleep(options_.projector.latency, {});
    const auto truth = (*made)->truth();
    ASSERT_TRUE(truth);
    EXPECT_GT(truth->patch_irradiance[1][0], 50.0 * truth->patch_irradiance[0][0]);
    EXPECT_GT(truth->patch_irradiance[1][0], 50.0 * truth->patch_irradiance[2][0]);
    const auto frame = camera.capture({kTurn, 1}, {});
    ASSERT_TRUE(frame);
    const auto code_at = [&](double x, double y) {
      const auto pixel = options_.camera.model.project({x, y, block.size().z});
      double sum = 0.0;
      for (int dy = -3; dy < 3; ++dy) {
        for (int dx = -3; dx < 3; ++dx) {
          sum +=
              frame->pixels.at(static_cast<int>(pixel.x) + dx, static_cast<int>(pixel.y) + dy, 0) -
              64.0;
        }
      }
      return sum / 36.0;
    };
    const double lit_patch = code_at(6.0, 2.0);
    const double beside = std::max({code_at(2.0, 2.0), code_at(6.0, 6.0), code_at(2.0, 6.0)});
    // From behind, 4 mm of scattering blur a patch of 4 mm; from in front little of the light gets to the next one.
    EXPECT_GT(lit_patch, (lit == Face::kZMin ? 1.5 : 5.0) * beside) << to_string(lit);
    EXPECT_GT(lit_patch, 20.0);
  }
}

}  // namespace
}  // namespace opaline::sim
