// A person holds the board: the simulated operator takes the next pose when the lamp goes dark, and the step waits for it.

#include "calibration/posing.h"

#include <gmock/gmock.h>

#include <memory>

#include "base/clock.h"
#include "calibration/frame_taker.h"
#include "sim/board_optics.h"
#include "sim/rig.h"
#include "sim/sim_camera.h"
#include "sim/sim_projector.h"

namespace opaline::calibration {
namespace {

using ::testing::HasSubstr;

/// Holds the board as told, and has no patience: what it waits for is over at its third look.
class Holder : public Attendant {
 public:
  explicit Holder(ManualClock& clock) : clock_(clock) {}
  bool holds_the_board() const override { return true; }
  PoseAnswer answer() override { return says_; }
  void saw(const Frame& /*frame*/) override { ++frames_; }
  void saw(const PoseSight& sight) override {
    if (sight.taken) {
      ++taken_;
    } else {
      doings_.push_back(sight.doing);
      clock_.advance(kPosePatience / 2);
    }
  }
  ManualClock& clock_;
  PoseAnswer says_ = PoseAnswer::kNone;
  std::vector<std::string> doings_;
  int taken_ = 0;
  int frames_ = 0;
};

class Messages : public EventSink {
 public:
  void progress(const Progress& /*p*/) override {}
  Result<void> fact(std::string_view /*type*/, const nlohmann::json& data) override {
    facts_.push_back(data);
    return ok();
  }
  std::vector<nlohmann::json> facts_;
};

class PosingTest : public ::testing::Test {
 protected:
  void build(bool moves) {
    options_.camera.model = sim::board_camera(320, 240);
    sim::BoardSceneOptions scene;
    scene.board = {.squares_x = 10, .squares_y = 7, .square_mm = 13.0, .margin_mm = 6.0};
    scene.projector = sim::board_projector(options_.projector.width, options_.projector.height);
    scene.poses = sim::held_poses(scene.board, options_.camera.model, scene.projector, 350.0, 2, 7);
    if (!moves) scene.poses.resize(1);
    auto rig = sim::Rig::create(
        options_,
        std::make_shared<const sim::BoardOptics>(options_.camera, options_.projector, scene),
        &clock_);
    ASSERT_TRUE(rig) << rig.error().message;
    rig_ = *std::move(rig);
    camera_ = std::make_unique<sim::SimCamera>(*rig_);
    projector_ = std::make_unique<sim::SimProjector>(*rig_);
    auto taker = FrameTaker::create({*camera_, *projector_, clock_}, events_);
    ASSERT_TRUE(taker) << taker.error().message;
    taker_ = *std::move(taker);
    record_.measured.black_level = options_.camera.black_level;
    record_.measured.clipping_code = options_.camera.max_code();
    record_.measured.response = capture::ResponseCurve{};
    record_.measured.projector_gamma = options_.projector.gamma;
    geometry_.board = {
        .squares_x = 10, .squares_y = 7, .square_mm = 13.0, .known_length_mm = 104.0};
  }
  Result<Poses> take(int poses) {
    geometry_.poses = poses;
    StepContext context{*taker_, given_, record_, events_, {}, "geometry", geometry_, &holder_};
    const auto brightness = find_brightness(context);
    if (!brightness) return brightness.error();
    return take_poses(context, *brightness);
  }

  ManualClock clock_;
  sim::RigOptions options_;
  std::unique_ptr<sim::Rig> rig_;
  std::unique_ptr<sim::SimCamera> camera_;
  std::unique_ptr<sim::SimProjector> projector_;
  Messages events_;
  std::unique_ptr<FrameTaker> taker_;
  capture::StationCalibration given_;
  Record record_;
  GeometryOptions geometry_;
  Holder holder_{clock_};
};

TEST_F(PosingTest, TakesAPoseOnceTheBoardHasMovedAndStandsStill) {
  build(true);
  const auto poses = take(2);
  ASSERT_TRUE(poses) << poses.error().message;
  EXPECT_EQ(holder_.taken_, 2);
  EXPECT_EQ(holder_.doings_,
            (std::vector<std::string>{"hold it still", "taking it", "hold it still", "taking it"}));
  for (const BoardView& view : poses->camera) EXPECT_EQ(view.fault, "");
  ASSERT_EQ(events_.facts_.size(), 2U);
  EXPECT_GT(events_.facts_[0]["coverage"].get<double>(), 0.1);
  EXPECT_THAT(events_.facts_[0]["message"].get<std::string>(),
              HasSubstr("; next: the board towards"));
  EXPECT_FALSE(events_.facts_[1].contains("next"));
}

TEST_F(PosingTest, DoesNotTakeOnePoseTwiceAndEndsWhenNobodyMovesTheBoard) {
  build(false);
  const auto poses = take(6);
  ASSERT_FALSE(poses);
  EXPECT_EQ(poses.error().code, ErrorCode::kTimeout);
  EXPECT_THAT(poses.error().message,
              HasSubstr("nobody came to hold the board for 3 poses in a row"));
  EXPECT_EQ(holder_.taken_, 1);
  EXPECT_THAT(events_.facts_.back()["fault"].get<std::string>(),
              HasSubstr("hold the board towards"));
}

TEST_F(PosingTest, DoesAsTheOperatorSays) {
  build(false);
  holder_.says_ = PoseAnswer::kTake;
  const auto twice = take(2);
  ASSERT_TRUE(twice) << twice.error().message;
  EXPECT_EQ(holder_.taken_, 2);
  holder_.says_ = PoseAnswer::kEnough;
  const auto none = take(2);
  ASSERT_TRUE(none) << none.error().message;
  EXPECT_TRUE(none->camera.empty());
}

}  // namespace
}  // namespace opaline::calibration
