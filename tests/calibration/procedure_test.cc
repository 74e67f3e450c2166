#include "calibration/procedure.h"

#include <gmock/gmock.h>

#include <cmath>

#include "base/clock.h"
#include "calibration/measured_station.h"
#include "calibration/response_fit.h"
#include "sim/rig.h"
#include "sim/sim_camera.h"
#include "sim/sim_projector.h"
#include "tests/support/simulated_station.h"

namespace opaline::calibration {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

constexpr int kAlways = 1'000'000;

/// The simulated rig in this process, on a clock that sleeping advances.
class ProcedureTest : public ::testing::Test {
 protected:
  void SetUp() override {
    options_ = support::tiny_rig();
    CameraModel& model = options_.camera.model;
    model.width = model.height = 128;
    model.fx = model.fy = 1000.0;
    model.cx = model.cy = 64.0;
    given_.camera.model = options_.camera.model;
  }
  void build() {
    auto rig = sim::Rig::create(options_, support::tiny_responses(), &clock_);
    ASSERT_TRUE(rig) << rig.error().message;
    rig_ = *std::move(rig);
    camera_ = std::make_unique<sim::SimCamera>(*rig_);
    projector_ = std::make_unique<sim::SimProjector>(*rig_);
    record_.version = 1;
  }
  void always(sim::FaultKind kind, int skip = 0) {
    ASSERT_TRUE(rig_->add({{.kind = kind, .skip = skip, .count = kAlways}}));
  }
  Result<void> run(std::optional<std::string> only = {}) {
    return run_procedure(record_,
                         {std::move(only), {}},
                         given_,
                         {*camera_, *projector_, clock_},
                         [&](const Record& record) {
                           kept_.push_back(to_text(record));
                           if (keep_) keep_(record);
                           return ok();
                         },
                         events_,
                         {});
  }
  /// The last step's refusal.
  std::string refused() {
    const auto done = run();
    EXPECT_TRUE(done) << done.error().message;
    EXPECT_EQ(record_.state(), RecordState::kRefused);
    return refusal(record_.steps.back());
  }

  Result<Agreement> compare() {
    return compare_with_station(record_, given_, {*camera_, *projector_, clock_}, events_, {});
  }

  std::function<void(const Record&)> keep_;
  sim::RigOptions options_;
  capture::StationCalibration given_;
  ManualClock clock_;
  std::unique_ptr<sim::Rig> rig_;
  std::unique_ptr<sim::SimCamera> camera_;
  std::unique_ptr<sim::SimProjector> projector_;
  NullSink events_;
  Record record_;
  std::vector<std::string> kept_;
};

// Black: 3 x 16384 samples of 1.2 codes make 0.006 codes; what is allowed is a tenth of the alarm for a drift. Gain: about twice
// the deviation that photon transfer itself gives for three channels of this size (1.1 % / sqrt(3)), and a little. Read noise:
// within 5 %.
TEST_F(ProcedureTest, FindsWhatALinearCameraWasMadeFrom) {
  build();
  const auto done = run();
  ASSERT_TRUE(done) << done.error().message;
  ASSERT_EQ(record_.state(), RecordState::kAccepted) << refusal(record_.steps.back());
  const Measured& m = record_.measured;
  EXPECT_NEAR(*m.black_level, options_.camera.black_level, 0.03);
  EXPECT_NEAR(m.dark_codes_per_second, 1.0 / 2.5, 0.02);
  EXPECT_EQ(m.response->kind, capture::ResponseCurve::Kind::kLinear);
  EXPECT_EQ(*m.clipping_code, 4095.0);
  EXPECT_NEAR(*m.gain_electrons_per_code, 2.5, 0.02 * 2.5);
  EXPECT_NEAR(*m.read_noise_electrons, 3.0, 0.15);
  EXPECT_NEAR(*m.projector_gamma, options_.projector.gamma, 0.01);
  // White is known as well as gamma, 0.01 ln(255 / code), and exposures to 1e-4.
  EXPECT_NEAR(
      *m.projector_black, options_.projector.black_level, 0.02 * options_.projector.black_level);
  EXPECT_EQ(with_measured(given_, m).projector.black_level, *m.projector_black);
  EXPECT_EQ(kept_.size(), kSteps.size() - 1);  // no board
  EXPECT_LT(record_.margin(), 0.75);
}

TEST_F(ProcedureTest, FindsTheResponseOfAnEightBitCameraWithGamma) {
  options_.camera.response_gamma = 2.2;
  options_.camera.bit_depth = 8;
  options_.camera.black_level = 32.0;  // gamma makes 3 electrons 6 codes in the dark
  options_.camera.gain_electrons_per_code = 40.0;
  options_.camera.full_well_electrons = 20000.0;
  build();
  const auto done = run();
  ASSERT_TRUE(done) << done.error().message;
  ASSERT_EQ(record_.state(), RecordState::kAccepted) << refusal(record_.steps.back());
  const Measured& m = record_.measured;
  ASSERT_EQ(m.response->kind, capture::ResponseCurve::Kind::kTable);
  double squares = 0.0;
  for (int i = 5; i <= 95; ++i) {
    const double f = 0.01 * i;
    squares += std::pow(signal_at(*m.response, f) - std::pow(f, 2.2), 2) / 91.0;
  }
  EXPECT_LT(std::sqrt(squares), 0.01);  // the goal
  EXPECT_NEAR(*m.gain_electrons_per_code, 40.0, 0.05 * 40.0);
}

TEST_F(ProcedureTest, FindsWherePixelsAreFullBelowTheHighestCode) {
  options_.camera.full_well_electrons = 7500.0;
  build();
  ASSERT_TRUE(run());
  ASSERT_EQ(record_.state(), RecordState::kAccepted) << refusal(record_.steps.back());
  EXPECT_NEAR(*record_.measured.clipping_code, 64.0 + 7500.0 / 2.5, 2.0);
  EXPECT_NEAR(with_measured(given_, record_.measured).camera.full_well_electrons, 7500.0, 110.0);
}

TEST_F(ProcedureTest, RefusesAProjectorWhoseGammaIsOn) {
  build();
  always(sim::FaultKind::kGammaOn);
  EXPECT_THAT(refused(), AllOf(HasSubstr("linearity: projector gamma"), HasSubstr("4.8")));
  EXPECT_EQ(record_.steps.size(), 3u);  // nothing after it was done
}

TEST_F(ProcedureTest, RefusesABlackThatDriftsWhileItIsMeasured) {
  build();
  keep_ = [&](const Record& record) {
    if (record.steps.back().step == "radiometric") always(sim::FaultKind::kBlackDrift);
  };
  EXPECT_THAT(refused(), HasSubstr("check: drifted black"));
}

TEST_F(ProcedureTest, RefusesACameraWithATenthOfItsPixelsHot) {
  options_.camera.hot_pixel_fraction = 0.1;
  build();
  EXPECT_THAT(refused(), AllOf(HasSubstr("black_level: hot pixels"), HasSubstr("cool the camera")));
}

TEST_F(ProcedureTest, RefusesTooMuchLight) {
  for (double& peak : options_.projector.peak_irradiance) peak *= 1e4;
  build();
  EXPECT_THAT(refused(), HasSubstr("warm_up: saturated at the dimmest light: close the aperture"));
}

TEST_F(ProcedureTest, RefusesALensCap) {
  for (double& s : options_.camera.sensitivity) s *= 1e-5;
  build();
  EXPECT_THAT(refused(), HasSubstr("warm_up: no light"));
}

TEST_F(ProcedureTest, RefusesSwappedChannels) {
  build();
  always(sim::FaultKind::kSwappedChannels);
  EXPECT_THAT(refused(),
              AllOf(HasSubstr("linearity: swapped channels"),
                    HasSubstr("the projector's blue is seen by the camera's red")));
}

TEST_F(ProcedureTest, RefusesALampThatFlickersAndAWheelOutOfStep) {
  build();
  always(sim::FaultKind::kFlicker);
  const std::string flicker = refused();
  EXPECT_THAT(flicker, HasSubstr("warm_up: flicker"));
  EXPECT_THAT(flicker, Not(HasSubstr("wheel beat")));
  ASSERT_TRUE(rig_->arm({}));
  always(sim::FaultKind::kWheelBeat);
  EXPECT_THAT(refused(), HasSubstr("warm_up: colour wheel beat"));
}

TEST_F(ProcedureTest, RefusesAShutterThatIsNotWhatItReports) {
  build();
  always(sim::FaultKind::kUnreportedExposure);
  EXPECT_THAT(refused(), HasSubstr("exposure times"));
}

TEST_F(ProcedureTest, GoesOnWhereItWasRefusedOnceTheFaultIsGone) {
  build();
  always(sim::FaultKind::kGammaOn);
  refused();
  ASSERT_TRUE(rig_->arm({}));
  const std::string black = record_.find("black_level")->finished;
  ASSERT_TRUE(run());
  EXPECT_EQ(record_.state(), RecordState::kAccepted);
  EXPECT_EQ(record_.find("black_level")->finished, black);
}

TEST_F(ProcedureTest, DoesOneStepOnlyAfterThoseBeforeIt) {
  build();
  const auto early = run("radiometric");
  ASSERT_FALSE(early);
  EXPECT_EQ(early.error().code, ErrorCode::kInvalidArgument);
  EXPECT_THAT(early.error().message, HasSubstr("needs black_level"));
  EXPECT_THAT(run("flavour").error().message, HasSubstr("no step \"flavour\"; there are warm_up"));
  ASSERT_TRUE(run("black_level"));
  EXPECT_EQ(record_.state(), RecordState::kIncomplete);
  ASSERT_TRUE(run());
  ASSERT_EQ(record_.state(), RecordState::kAccepted);
  ASSERT_TRUE(run("linearity"));  // what rested on the old one is gone
  EXPECT_EQ(record_.find("radiometric"), nullptr);
}

TEST_F(ProcedureTest, StopsWhenAsked) {
  build();
  std::stop_source stop;
  stop.request_stop();
  const auto done = run_procedure(
      record_,
      {},
      given_,
      {*camera_, *projector_, clock_},
      [](const Record&) { return ok(); },
      events_,
      stop.get_token());
  EXPECT_EQ(done.error().code, ErrorCode::kCancelled);
  EXPECT_FALSE(rig_->status()->lamp_on);
}

TEST_F(ProcedureTest, WorksThroughFramesThatShowSomethingElse) {
  build();
  ASSERT_TRUE(rig_->add({{.kind = sim::FaultKind::kTornFrame, .skip = 20},
                         {.kind = sim::FaultKind::kStaleFrame, .skip = 30},
                         {.kind = sim::FaultKind::kCameraLost, .skip = 40}}));
  const auto done = run();
  ASSERT_TRUE(done) << done.error().message;
  EXPECT_EQ(record_.state(), RecordState::kAccepted);
}

TEST_F(ProcedureTest, AStationAgreesWithItsCalibrationUntilSomethingChanges) {
  build();
  ASSERT_TRUE(run());
  EXPECT_EQ(compare().value(), Agreement{});
  always(sim::FaultKind::kBlackDrift);
  EXPECT_THAT(compare()->doubts, ElementsAre(HasSubstr("drifted black: 88")));
  ASSERT_TRUE(rig_->arm({}));
  always(sim::FaultKind::kGammaOn);
  EXPECT_THAT(compare()->wrong, HasSubstr("projector gamma"));
  options_.projector.black_level *= 2.0;  // the lamp's iris, say
  build();
  EXPECT_THAT(compare()->doubts, ElementsAre(HasSubstr("drifted projector black: 0.0020")));
  options_.seed = 2;
  build();
  EXPECT_THAT(compare()->wrong, HasSubstr("(sim-1)"));
}

TEST_F(ProcedureTest, ARecordReadsBackAsItWasWritten) {
  options_.camera.response_gamma = 2.2;
  options_.camera.black_level = 512.0;
  options_.camera.gain_electrons_per_code = 2.8;
  build();
  ASSERT_TRUE(run());
  ASSERT_EQ(record_.state(), RecordState::kAccepted) << refusal(record_.steps.back());
  const auto read = record_from_text(kept_.back(), "calibration.json");
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(to_text(*read), kept_.back());
  EXPECT_EQ(read->measured.response->table, record_.measured.response->table);
}

}  // namespace
}  // namespace opaline::calibration
