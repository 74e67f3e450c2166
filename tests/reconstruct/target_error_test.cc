#include "reconstruct/target_error.h"

#include <gmock/gmock.h>

#include "reconstruct/host/host_solver.h"
#include "reconstruct/inverse_solver.h"
#include "tests/support/synthetic_dataset.h"
#include "tests/support/temporary_directory.h"

namespace opaline::reconstruct {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using testing_support::make_synthetic_dataset;

/// Keeps what is told.
class RecordingSink : public EventSink {
 public:
  void progress(const Progress& progress) override { last = progress; }
  Result<void> fact(std::string_view type, const nlohmann::json& data) override {
    if (type == "accuracy.measured") measured.push_back(data);
    if (type == "channel.reconstructed") ++channels;
    return ok();
  }
  Progress last;
  std::vector<nlohmann::json> measured;
  int channels = 0;
};

class TargetErrorTest : public ::testing::Test {
 protected:
  Result<TargetResult> climb(const Dataset& dataset, double target) {
    return reconstruct_to_target(dataset, target, {}, {}, {*solver_, events_, clock_}, {});
  }
  std::unique_ptr<diffusion::FluenceSolver> solver_ = host::make_host_solver({.threads = 2});
  RecordingSink events_;
  const SystemClock clock_;
};

const Dataset& veined() {
  static const Dataset dataset = make_synthetic_dataset({.block = {12, 12, 4, 1.0, 1.0, 1.0}});
  return dataset;
}

TEST_F(TargetErrorTest, StopsAtTheHomogeneousSampleWhereThatWillDo) {
  const auto found = climb(make_synthetic_dataset({.heterogeneous = false}), 0.2);
  ASSERT_TRUE(found) << found.error().message;
  EXPECT_TRUE(found->report.reached);
  EXPECT_EQ(found->report.rungs.size(), 1u);
  EXPECT_LE(found->result.held_out.error, 0.2);
  EXPECT_THAT(found->report.message, HasSubstr("a homogeneous sample"));
  for (const ChannelReport& channel : found->result.channels)
    EXPECT_EQ(channel.history.size(), 1u);  // no iteration beyond the fit
}

TEST_F(TargetErrorTest, ClimbsUntilTheTargetIsReached) {
  const auto cheap = climb(veined(), 0.6);
  const auto dear = climb(veined(), 0.1);
  ASSERT_TRUE(cheap && dear);
  ASSERT_TRUE(cheap->report.reached) << cheap->report.message;
  ASSERT_TRUE(dear->report.reached) << dear->report.message;
  EXPECT_LT(cheap->report.rungs.size(), dear->report.rungs.size());
  EXPECT_LE(dear->result.held_out.error, 0.1);
  const auto& rungs = dear->report.rungs;
  for (std::size_t r = 0; r + 1 < rungs.size(); ++r) EXPECT_GT(rungs[r].held_out.error, 0.1);
  EXPECT_EQ(dear->result.material.block, veined().block);
  EXPECT_EQ(dear->result.predicted.size(), veined().illuminations.size());
}

TEST_F(TargetErrorTest, SaysHowFarItCameWhereTheTargetIsOutOfReach) {
  const auto found = climb(veined(), 0.012);  // the noise is 0.01
  ASSERT_TRUE(found) << found.error().message;
  EXPECT_FALSE(found->report.reached);
  EXPECT_EQ(found->report.rungs.size(), rungs({}, {}).size());
  EXPECT_THAT(found->report.message,
              AllOf(HasSubstr("of the 1.2 % asked for"), HasSubstr("no setting")));
  for (const RungReport& rung : found->report.rungs)
    EXPECT_LE(found->result.held_out.error, rung.held_out.error);
  EXPECT_EQ(events_.measured.size(), found->report.rungs.size());
}

TEST_F(TargetErrorTest, TriesNothingButTheSettingsAsGivenBelowTheNoise) {
  const auto found = climb(veined(), 0.001);
  ASSERT_TRUE(found) << found.error().message;
  EXPECT_FALSE(found->report.reached);
  EXPECT_EQ(found->report.rungs.size(), 1u);
  EXPECT_THAT(found->report.message, HasSubstr("longer exposures"));
}

TEST_F(TargetErrorTest, RefusesATargetThatCannotBeMeasured) {
  EXPECT_FALSE(climb(veined(), 0.0));
  EXPECT_FALSE(climb(veined(), 1.0));
  Dataset fitted_only = veined();
  std::erase_if(fitted_only.illuminations, [](const Illumination& i) { return i.held_out; });
  const auto found = climb(fitted_only, 0.1);
  ASSERT_FALSE(found);
  EXPECT_THAT(found.error().message, HasSubstr("kept from the fit"));
}

TEST_F(TargetErrorTest, RepeatsNoRungThatItFinishedBeforeItWasInterrupted) {
  const testing::TemporaryDirectory directory;
  const ReducedContext context{*solver_, events_, clock_, &system_files(), directory.path()};
  const auto first = reconstruct_to_target(veined(), 0.1, {}, {}, context, {});
  ASSERT_TRUE(first);
  const int solved = events_.channels;
  const auto again = reconstruct_to_target(veined(), 0.1, {}, {}, context, {});
  ASSERT_TRUE(again);
  EXPECT_EQ(events_.channels, solved);
  EXPECT_EQ(again->result.material, first->result.material);
}

TEST(Reduction, GivesTheMaterialOnTheSamplesOwnCells) {
  const auto solver = host::make_host_solver({.threads = 2});
  NullSink events;
  const SystemClock clock;
  const ReducedContext context{*solver, events, clock};
  const auto half = reconstruct_reduced(veined(), {2.0, 2}, {}, context, {});
  const auto full = reconstruct_reduced(veined(), {}, {}, context, {});
  ASSERT_TRUE(half && full);
  EXPECT_EQ(half->material.block, veined().block);
  EXPECT_GT(half->held_out.error, full->held_out.error);  // judged by all that was measured
  EXPECT_DOUBLE_EQ(half->held_out.noise_floor, full->held_out.noise_floor);
}

TEST(Reduction, RefusesWhatIsNoReduction) {
  EXPECT_FALSE(validate(Reduction{.grid_step = 0.5}));
  EXPECT_FALSE(validate(Reduction{.regions = -1}));
  EXPECT_FALSE(reduced(veined(), {.grid_step = std::nan("")}));
}

}  // namespace
}  // namespace opaline::reconstruct
