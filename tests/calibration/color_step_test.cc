#include <gmock/gmock.h>

#include <memory>

#include "base/clock.h"
#include "calibration/procedure.h"
#include "sim/color_chart.h"
#include "sim/rig.h"
#include "sim/sim_camera.h"
#include "sim/sim_projector.h"
#include "tests/support/simulated_station.h"

namespace opaline::calibration {
namespace {

using ::testing::HasSubstr;

/// A station with a chart before its camera, whose other steps have been done.
class ColorStepTest : public ::testing::Test {
 protected:
  ColorStepTest() {
    options_ = support::tiny_rig();
    options_.camera.model.width = options_.camera.model.height = 192;
    options_.camera.sensitivity = {0.7e9, 1.0e9, 0.55e9};
    chart_ = sim::chart_before(options_.camera);
  }
  void build() {
    const auto path =
        std::make_shared<const sim::ChartOptics>(options_.camera, options_.projector, chart_);
    auto rig =
        sim::Rig::create(options_, std::static_pointer_cast<const sim::LightPath>(path), &clock_);
    ASSERT_TRUE(rig) << rig.error().message;
    rig_ = *std::move(rig);
    camera_ = std::make_unique<sim::SimCamera>(*rig_);
    projector_ = std::make_unique<sim::SimProjector>(*rig_);
    ASSERT_TRUE(camera_->open());
    const auto info = *camera_->info();
    camera_->close();
    ASSERT_TRUE(projector_->open());
    const auto lamp = *projector_->info();
    projector_->close();
    record_.camera = {info.model, info.serial, info.width, info.height, info.bit_depth};
    record_.projector = {lamp.model, lamp.serial, lamp.width, lamp.height, 0};
    for (const auto step : kSteps)
      record_.steps.push_back({std::string(step), "before", {}, nlohmann::json::object()});
    record_.measured.black_level = options_.camera.black_level;
    record_.measured.clipping_code = 4095.0;
    record_.measured.response = capture::ResponseCurve{};
    record_.measured.projector_gamma = options_.projector.gamma;
    given_.camera.model = options_.camera.model;
  }
  Result<void> run() {
    return run_procedure(record_,
                         {"colour"},
                         given_,
                         {*camera_, *projector_, clock_},
                         [](const Record&) { return ok(); },
                         events_,
                         {});
  }
  std::string refused() {
    const auto done = run();
    EXPECT_TRUE(done) << done.error().message;
    EXPECT_EQ(record_.state(), RecordState::kRefused);
    EXPECT_FALSE(record_.measured.color);
    return refusal(record_.steps.back());
  }

  sim::RigOptions options_;
  sim::ChartOptions chart_;
  capture::StationCalibration given_;
  ManualClock clock_;
  std::unique_ptr<sim::Rig> rig_;
  std::unique_ptr<sim::SimCamera> camera_;
  std::unique_ptr<sim::SimProjector> projector_;
  NullSink events_;
  Record record_;
};

TEST_F(ColorStepTest, CorrectsTheColoursOfAChartThatItFinds) {
  build();
  const auto done = run();
  ASSERT_TRUE(done) << done.error().message;
  ASSERT_EQ(record_.state(), RecordState::kAccepted) << refusal(record_.steps.back());
  EXPECT_EQ(record_.steps.back().step, "colour");
  ASSERT_TRUE(record_.measured.color);
  EXPECT_NEAR(
      record_.measured.color->white_balance[0], 1.0 / 0.7, 0.03);  // the white patch is greyish
  EXPECT_NEAR(record_.measured.color->white_balance[2], 1.0 / 0.55, 0.06);
  const auto read = record_from_text(to_text(record_), "calibration.json");
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(read->measured.color->coefficients, record_.measured.color->coefficients);
  EXPECT_EQ(read->measured.color->model, record_.measured.color->model);
}

TEST_F(ColorStepTest, SaysThatThereIsNoChart) {
  chart_.corners = {{{900, 900}, {1000, 900}, {1000, 960}, {900, 960}}};
  build();
  EXPECT_THAT(refused(), HasSubstr("no chart"));
}

TEST_F(ColorStepTest, NamesSwappedChannels) {
  build();
  ASSERT_TRUE(rig_->add({{.kind = sim::FaultKind::kSwappedChannels, .skip = 0, .count = 1000}}));
  EXPECT_THAT(refused(), HasSubstr("swapped channels"));
}

// The lamp's mirror image fills too few pixels for the exposure to be chosen by.
TEST_F(ColorStepTest, NamesASaturatedChart) {
  chart_.gloss_px = 2.0;
  build();
  EXPECT_THAT(refused(), HasSubstr("saturated chart"));
}

TEST_F(ColorStepTest, IsDoneOnlyAfterTheOthers) {
  build();
  record_.steps.pop_back();
  const auto done = run();
  ASSERT_FALSE(done);
  EXPECT_THAT(done.error().message, HasSubstr("colour needs check"));
}

}  // namespace
}  // namespace opaline::calibration
