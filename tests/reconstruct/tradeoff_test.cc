#include "reconstruct/tradeoff.h"

#include <gmock/gmock.h>

#include <set>

#include "reconstruct/host/host_solver.h"
#include "tests/support/synthetic_dataset.h"

namespace opaline::reconstruct {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using testing_support::make_synthetic_dataset;

Result<TradeoffSolver> host_only(const TradeoffSetting& setting) {
  if (setting.options.back_end == BackEnd::kVulkan) return unavailable("no Vulkan device will do");
  return TradeoffSolver{host::make_host_solver({.threads = 2})};
}

class TradeoffTest : public ::testing::Test {
 protected:
  TradeoffContext context() { return {host_only, events_, clock_, {}}; }
  const Dataset& dataset() {
    static const Dataset dataset = make_synthetic_dataset({.block = {8, 8, 4, 1.0, 1.0, 1.0}});
    return dataset;
  }
  NullSink events_;
  const SystemClock clock_;
};

TEST_F(TradeoffTest, PlansEachSettingOnceAndTheCheapOnesFirst) {
  const TradeoffPlan plan = plan_tradeoff(dataset(), false);
  EXPECT_THAT(plan.regions, ElementsAre(3, 1));
  const auto settings = settings_of(plan, {});
  std::set<std::string> names;
  std::size_t given = 0;
  std::size_t corrected = 0;
  for (const TradeoffSetting& s : settings) {
    EXPECT_TRUE(names.insert(s.dial + describe(s)).second) << describe(s);
    given += s.dial == "given" ? 1 : 0;
    corrected += s.options.grid_correction ? 1 : 0;
    EXPECT_TRUE(validate(s.options)) << describe(s);
    EXPECT_TRUE(validate(s.reduction)) << describe(s);
  }
  EXPECT_EQ(given, 1u);
  EXPECT_EQ(corrected, 1u);
  EXPECT_EQ(settings.front().reduction.regions, 1);
  EXPECT_EQ(settings.front().reduction.grid_step, 4.0);
  EXPECT_LT(settings_of(plan_tradeoff(dataset(), true), {}).size(), settings.size());
}

TEST_F(TradeoffTest, MeasuresSecondsAndTheErrorOfHeldOutLights) {
  auto with_truth = context();
  with_truth.bssrdf_error = [](const Material& material, const std::stop_token&) -> Result<double> {
    return material.channels[0].absorption.size() == 256 ? 0.5 : -1.0;
  };
  const auto point = measure(dataset(), {"given", {2.0, 1}, {}}, with_truth, {});
  ASSERT_TRUE(point) << point.error().message;
  EXPECT_EQ(point->failed, "");
  EXPECT_GT(point->seconds, 0.0);
  EXPECT_GT(point->solves, 0);
  EXPECT_GT(point->held_out.error, point->held_out.noise_floor);
  EXPECT_EQ(point->grid.cell_count(), 4u * 4u * 2u);
  EXPECT_EQ(point->bssrdf_error, 0.5);  // of the material on the sample's own cells
}

TEST_F(TradeoffTest, TellsWhyASettingHasNoFigureAndGoesOn) {
  InverseOptions options;
  options.back_end = BackEnd::kVulkan;
  const auto unavailable = measure(dataset(), {"back end", {}, options}, context(), {});
  ASSERT_TRUE(unavailable);
  EXPECT_THAT(unavailable->failed, HasSubstr("no Vulkan device"));
  auto hasty = context();
  hasty.limit_seconds = 1e-3;
  const auto late = measure(dataset(), {"given", {}, {}}, hasty, {});
  ASSERT_TRUE(late);
  EXPECT_THAT(late->failed, HasSubstr("given up after 0.001 s"));
}

TEST_F(TradeoffTest, EndsWhenItIsToldTo) {
  std::stop_source stop;
  stop.request_stop();
  const auto point = measure(dataset(), {"given", {}, {}}, context(), stop.get_token());
  ASSERT_FALSE(point);
  EXPECT_EQ(point.error().code, ErrorCode::kCancelled);
}

TradeoffPoint at(double seconds, double error) {
  TradeoffPoint p{};
  p.seconds = seconds;
  p.held_out.error = error;
  return p;
}

TEST(TradeoffFront, HoldsWhatNothingBeatsInBoth) {
  std::vector<TradeoffPoint> points{
      at(1, 0.3), at(2, 0.1), at(3, 0.2), at(4, 0.05), at(4, 0.06), at(2, 0.1)};
  points.push_back(at(0.0, 0.0));
  points.back().failed = "no such device";
  mark_front(points);
  std::vector<bool> front;
  for (const TradeoffPoint& p : points) front.push_back(p.on_front);
  EXPECT_THAT(front, ElementsAre(true, true, false, true, false, true, false));
}

TEST(TradeoffTable, IsCommaSeparatedWithOneLineAPoint) {
  std::vector<TradeoffPoint> points{at(1.5, 0.25), at(0, 0)};
  points[0].setting.dial = "regions and grid";
  points[0].bssrdf_error = 0.0125;
  points[1].failed = "given up, \"late\"";
  const std::string csv = tradeoff_csv(points);
  EXPECT_EQ(std::ranges::count(csv, '\n'), 3);
  EXPECT_THAT(
      csv,
      HasSubstr(
          "\"regions and grid\",0,1,1x1x1,1e-05,150,lbfgs,auto,single,1.5,0,0.25,0,0.0125,0,\n"));
  EXPECT_THAT(csv, HasSubstr("\"given up, \"\"late\"\"\"\n"));
}

}  // namespace
}  // namespace opaline::reconstruct
