// The step "geometry" through the devices of the simulated rig, whose operator takes the next pose whenever the lamp goes dark.

#include <fmt/format.h>
#include <gmock/gmock.h>

#include <cmath>
#include <functional>
#include <memory>

#include "base/clock.h"
#include "calibration/measured_station.h"
#include "calibration/procedure.h"
#include "sim/board_optics.h"
#include "sim/rig.h"
#include "sim/sim_camera.h"
#include "sim/sim_projector.h"

namespace opaline::calibration {
namespace {

using ::testing::HasSubstr;

constexpr double kSquare = 13.0;
constexpr int kSquaresX = 10;

class Listener : public EventSink {
 public:
  void progress(const Progress& /*p*/) override {}
  Result<void> fact(std::string_view type, const nlohmann::json& data) override {
    if (type == "pose.taken" && on_pose) on_pose(data["pose"]);
    return ok();
  }
  std::function<void(int)> on_pose;
};

class GeometryTest : public ::testing::Test {
 protected:
  void SetUp() override {
    options_.camera.model = sim::board_camera(400, 300);
    scene_.board = {.squares_x = kSquaresX, .squares_y = 7, .square_mm = kSquare, .margin_mm = 6.0};
    scene_.projector = sim::board_projector(options_.projector.width, options_.projector.height);
    geometry_.board = {.squares_x = kSquaresX,
                       .squares_y = 7,
                       .square_mm = kSquare,
                       .known_length_mm = (kSquaresX - 2) * kSquare};
    // What the steps before would have found.
    for (const std::string_view step : {"warm_up", "black_level", "linearity", "radiometric"})
      record_.steps.push_back({std::string(step), {}, {}, nlohmann::json::object()});
    record_.measured.black_level = options_.camera.black_level;
    record_.measured.clipping_code = options_.camera.max_code();
    record_.measured.response = capture::ResponseCurve{};
    record_.measured.projector_gamma = options_.projector.gamma;
  }

  void build(int poses) {
    geometry_.poses = poses;
    scene_.poses =
        sim::held_poses(scene_.board, options_.camera.model, scene_.projector, 350.0, poses, 7);
    if (spoil_) spoil_(scene_.poses);
    auto rig = sim::Rig::create(
        options_,
        std::make_shared<const sim::BoardOptics>(options_.camera, options_.projector, scene_),
        &clock_);
    ASSERT_TRUE(rig) << rig.error().message;
    rig_ = *std::move(rig);
    camera_ = std::make_unique<sim::SimCamera>(*rig_);
    projector_ = std::make_unique<sim::SimProjector>(*rig_);
    identify();
  }

  /// The record is of these devices.
  void identify() {
    ASSERT_TRUE(camera_->open());
    ASSERT_TRUE(projector_->open());
    const auto camera = camera_->info();
    const auto projector = projector_->info();
    record_.camera = {
        camera->model, camera->serial, camera->width, camera->height, camera->bit_depth};
    record_.projector = {
        projector->model, projector->serial, projector->width, projector->height, 0};
  }

  Result<void> run() {
    capture::StationCalibration given;
    given.camera.model = options_.camera.model;
    return run_procedure(record_,
                         {"geometry", geometry_},
                         given,
                         {*camera_, *projector_, clock_},
                         [](const Record&) { return ok(); },
                         events_,
                         {});
  }

  /// How many poses were left out for a reason with these words.
  int left_out_for(const std::string& words) const {
    int count = 0;
    for (const auto& pose : record_.find("geometry")->values["poses"])
      count += pose["left_out"].get<std::string>().find(words) != std::string::npos ? 1 : 0;
    return count;
  }

  /// RMS over a picture of 4 : 3.
  static double vignetting_off(const capture::Vignetting& is, const std::array<double, 3>& should) {
    double squares = 0.0;
    for (int y = -9; y <= 9; ++y) {
      for (int x = -12; x <= 12; ++x) {
        const double r2 = (x * x + y * y) / 225.0;
        squares += std::pow(is.at(r2) - capture::Vignetting{should}.at(r2), 2) / (19.0 * 25.0);
      }
    }
    return std::sqrt(squares);
  }

  sim::RigOptions options_;
  sim::BoardSceneOptions scene_;
  GeometryOptions geometry_;
  std::function<void(std::vector<sim::SimBoardPose>&)> spoil_;
  ManualClock clock_;
  std::unique_ptr<sim::Rig> rig_;
  std::unique_ptr<sim::SimCamera> camera_;
  std::unique_ptr<sim::SimProjector> projector_;
  Listener events_;
  Record record_;
};

// The limits on lengths and on what is left are the for a third of bad poses; the focal length's is four of its own deviations, the
// vignetting's what a session takes over at most.
TEST_F(GeometryTest, BadPosesAreNamedAndTheRestTellsTheLenses) {
  spoil_ = [](std::vector<sim::SimBoardPose>& poses) {
    poses[2].defocus_px = 2.5;
    poses[8].hidden = 0.3;
  };
  events_.on_pose = [this](int pose) {
    if (pose == 4) {
      EXPECT_TRUE(rig_->add({{.kind = sim::FaultKind::kMovedBoard, .skip = 6}}));
    }
  };
  build(12);
  const auto done = run();
  ASSERT_TRUE(done) << done.error().message;
  const StepRecord& step = *record_.find("geometry");
  ASSERT_TRUE(step.accepted()) << refusal(step);
  EXPECT_EQ(left_out_for("out of focus: its edges"), 1) << step.values.dump(1);
  EXPECT_EQ(left_out_for("no board found"), 1) << step.values.dump(1);
  EXPECT_EQ(left_out_for("moved board"), 1) << step.values.dump(1);
  EXPECT_EQ(step.values["poses_kept"], 9);
  EXPECT_LT(std::abs(step.values["length_error"].get<double>()), 0.001);
  EXPECT_LT(step.values["stereo_rms_px"].get<double>(), 0.15);
  const MeasuredLens& lens = *record_.measured.camera_lens;
  EXPECT_NEAR(lens.model.fx, options_.camera.model.fx, 4.0 * lens.deviation[0]);
  EXPECT_EQ(with_measured({}, record_.measured).camera.model.fx, lens.model.fx);
  ASSERT_TRUE(record_.measured.camera_vignetting) << step.values.dump(1);
  EXPECT_LT(vignetting_off(*record_.measured.camera_vignetting, options_.camera.vignetting), 0.005);
  EXPECT_LT(vignetting_off(*record_.measured.projector_vignetting, options_.projector.vignetting),
            0.005);
}

// As above; the place's limit is the one of tests/calibration/pair_fit_test.cc.
TEST_F(GeometryTest, ChessboardsThatTheProjectorShowsTellItsLensAndPlace) {
  geometry_.projected = GeometryOptions::Projected::kChessboards;
  build(8);
  const auto done = run();
  ASSERT_TRUE(done) << done.error().message;
  const StepRecord& step = *record_.find("geometry");
  ASSERT_TRUE(step.accepted()) << refusal(step);
  EXPECT_EQ(step.values["poses_kept"], 8) << step.values["poses"].dump(1);
  EXPECT_LT(std::abs(step.values["length_error"].get<double>()), 0.001);
  EXPECT_LT(step.values["projector_rms_px"].get<double>(), 0.05);
  const MeasuredLens& lens = *record_.measured.projector_lens;
  EXPECT_NEAR(lens.model.fx, scene_.projector.fx, 4.0 * lens.deviation[0]);
  const Vec3 off = lens.model.centre() - scene_.projector.centre();
  EXPECT_LT(length(off), 0.005 * length(scene_.projector.centre()));
}

TEST_F(GeometryTest, ProjectsNoChessboardsOnMarkers) {
  geometry_.projected = GeometryOptions::Projected::kChessboards;
  geometry_.board.kind = Board::Kind::kCharuco;
  geometry_.board.marker_mm = 8.0;
  build(6);
  const auto done = run();
  ASSERT_FALSE(done);
  EXPECT_THAT(done.error().message, HasSubstr("markers leave no white paper"));
}

TEST_F(GeometryTest, WrongSquaresAreRefusedByName) {
  geometry_.board.square_mm = 13.1;
  build(6);
  const auto done = run();
  ASSERT_TRUE(done) << done.error().message;
  EXPECT_THAT(refusal(*record_.find("geometry")), HasSubstr("geometry: wrong board size"));
  EXPECT_NEAR(
      record_.find("geometry")->values["length_error"].get<double>(), 13.1 / 13.0 - 1.0, 0.001);
}

TEST_F(GeometryTest, WithoutABoardInSightItIsRefusedAndSaysWhatWasWrongWithEachPose) {
  spoil_ = [](std::vector<sim::SimBoardPose>& poses) {
    for (auto& pose : poses) pose.hidden = 0.5;
  };
  build(6);
  const auto done = run();
  ASSERT_TRUE(done) << done.error().message;
  EXPECT_THAT(refusal(*record_.find("geometry")), HasSubstr("pose 6 (no board found"));
}

TEST_F(GeometryTest, NeedsAKnownLength) {
  geometry_.board.known_length_mm = 0.0;
  build(6);
  const auto done = run();
  ASSERT_FALSE(done);
  EXPECT_THAT(done.error().message, HasSubstr("known_length is missing"));
}

TEST_F(GeometryTest, NeedsABoard) {
  geometry_ = {};
  build(6);
  const auto done = run();
  ASSERT_FALSE(done);
  EXPECT_THAT(done.error().message, HasSubstr("[calibration.board]"));
}

TEST(GeometryRecord, LensesAreKeptOnDisk) {
  Record record;
  MeasuredLens lens;
  lens.model = sim::board_projector(640, 480);
  lens.deviation[4] = 0.25;
  record.measured.projector_lens = lens;
  constexpr std::array<double, 3> vignetting{-0.12, 0.01, 0.0};
  record.measured.camera_vignetting = capture::Vignetting{vignetting};
  const auto back = record_from_text(to_text(record), "calibration.json");
  ASSERT_TRUE(back) << back.error().message;
  EXPECT_EQ(back->measured.projector_lens->model, lens.model);
  EXPECT_EQ(back->measured.projector_lens->deviation, lens.deviation);
  EXPECT_FALSE(back->measured.camera_lens);
  EXPECT_EQ(back->measured.camera_vignetting->coefficients, vignetting);
  EXPECT_FALSE(back->measured.projector_vignetting);
  EXPECT_EQ(with_measured({}, back->measured).camera.vignetting.coefficients, vignetting);
}

}  // namespace
}  // namespace opaline::calibration
