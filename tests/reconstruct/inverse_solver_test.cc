#include "reconstruct/inverse_solver.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "reconstruct/diffusion/reference_solver.h"
#include "reconstruct/summary.h"
#include "tests/support/synthetic_dataset.h"
#include "tests/support/temporary_directory.h"

namespace opaline::reconstruct {
namespace {

using ::testing::HasSubstr;
using testing_support::make_synthetic_dataset;

testing_support::SyntheticOptions tiny() {
  return {.block = {8, 8, 4, 1.0, 1.0, 1.0}, .regions = 2};
}

// Asks for a stop after some progress reports, as an operator or a power cut would.
class StoppingSink : public NullSink {
 public:
  explicit StoppingSink(int reports) : left_(reports) {}
  void progress(const Progress& progress) override {
    last = progress;
    if (--left_ == 0) stop.request_stop();
  }
  std::stop_source stop;
  Progress last;

 private:
  int left_;
};

Result<InverseResult> invert(const Dataset& dataset,
                             const InverseOptions& options,
                             const CheckpointStore* checkpoints = nullptr) {
  const auto solver = diffusion::make_reference_solver();
  NullSink events;
  const SystemClock clock;
  return reconstruct_material(dataset, options, {*solver, events, clock, checkpoints}, {});
}

Result<InverseResult> invert_until(int reports,
                                   const Dataset& dataset,
                                   const InverseOptions& options,
                                   const CheckpointStore& checkpoints) {
  const auto solver = diffusion::make_reference_solver();
  StoppingSink events(reports);
  const SystemClock clock;
  return reconstruct_material(
      dataset, options, {*solver, events, clock, &checkpoints}, events.stop.get_token());
}

// 1 % noise and another discretisation: the error allowed is twice the noise floor and the grid's own (about 1 %).
TEST(InverseSolver, RelightsAHeterogeneousSampleUnderLightsItNeverSaw) {
  const Dataset dataset = make_synthetic_dataset({});
  const auto result = invert(dataset, {});
  ASSERT_TRUE(result) << result.error().message;
  for (const ChannelReport& channel : result->channels) {
    EXPECT_LT(channel.history.back().chi_squared_per_datum,
              0.05 * channel.homogeneous.chi_squared / static_cast<double>(channel.data_count));
    EXPECT_LE(channel.history.back().solves, 1500);
  }
  EXPECT_LE(result->fitted.error, 0.02);
  EXPECT_LE(result->held_out.error, 0.03);
}

// Coarse cells of 0.8 mm, about a transport mean free path: they see the sample.
TEST(InverseSolver, GetsFurtherInAsManyIterationsFromCoarseToFine) {
  const Dataset dataset =
      make_synthetic_dataset({.block = {16, 16, 8, 0.4, 0.4, 0.4}, .regions = 2});
  InverseOptions options;
  options.model = Model::kHeterogeneous;
  options.max_iterations = 4;
  options.coarser_grids = 0;
  const auto fine = invert(dataset, options);
  options.coarser_grids = 2;
  const auto both = invert(dataset, options);
  ASSERT_TRUE(fine && both);
  for (std::size_t c = 0; c < kColorChannels; ++c)
    EXPECT_LT(both->channels[c].history.back().chi_squared_per_datum,
              fine->channels[c].history.back().chi_squared_per_datum);
  EXPECT_LT(both->held_out.error, fine->held_out.error);
}

TEST(InverseSolver, ReachesTheNoiseByGaussNewtonToo) {
  const Dataset dataset = make_synthetic_dataset({.block = {10, 10, 5, 1.2, 1.2, 1.2}});
  InverseOptions options;
  options.model = Model::kHeterogeneous;
  const auto by_lbfgs = invert(dataset, options);
  options.method = Method::kGaussNewton;
  options.regularizer = Smoothness::kTotalVariation;
  const auto result = invert(dataset, options);
  ASSERT_TRUE(by_lbfgs && result);
  for (const ChannelReport& channel : result->channels)
    EXPECT_LT(channel.history.back().chi_squared_per_datum,
              0.05 * channel.homogeneous.chi_squared / static_cast<double>(channel.data_count));
  EXPECT_LT(result->held_out.error, 1.25 * by_lbfgs->held_out.error);
}

// Truth: 1.0 and 0.01 in red, 1.6 and 0.03 in blue. Twice the cell size, and light put at cell centres behind the
// pictures, leave some per cent, and absorption is the weaker of the two.
TEST(InverseSolver, RecoversAHomogeneousSample) {
  testing_support::SyntheticOptions synthetic;
  synthetic.block = {10, 10, 8, 0.5, 0.5, 0.5};
  synthetic.heterogeneous = false;
  InverseOptions options;
  options.max_iterations = 0;
  const auto result = invert(make_synthetic_dataset(synthetic), options);
  ASSERT_TRUE(result) << result.error().message;
  EXPECT_NEAR(result->channels[0].homogeneous.reduced_scattering, 1.0, 0.1);
  EXPECT_NEAR(result->channels[2].homogeneous.reduced_scattering, 1.6, 0.16);
  EXPECT_NEAR(result->channels[2].homogeneous.absorption, 0.03, 0.006);
  const auto json =
      nlohmann::json::parse(summary_json(make_synthetic_dataset(synthetic), options, *result));
  const auto& interval = json["channels"][0]["homogeneous"]["reduced_scattering_interval_95"];
  EXPECT_LT(interval[0], result->channels[0].homogeneous.reduced_scattering);
  EXPECT_GT(interval[1], result->channels[0].homogeneous.reduced_scattering);
}

class InterruptedInverseSolver : public ::testing::TestWithParam<bool> {};

TEST_P(InterruptedInverseSolver, GivesTheSameBitsAsOneThatWasNot) {
  const Dataset dataset = make_synthetic_dataset(tiny());
  InverseOptions options;
  options.grid_correction = GetParam();
  options.checkpoint_every = 3;
  options.max_iterations = 8;
  options.discrepancy = 0.0;
  const auto whole = invert(dataset, options);
  ASSERT_TRUE(whole);
  const opaline::testing::TemporaryDirectory directory;
  const CheckpointStore checkpoints(
      system_files(), directory.path(), fingerprint(dataset, options));
  for (const int reports : {1, 2, 6, 7, 12, 19}) {
    const auto cut = invert_until(reports, dataset, options, checkpoints);
    if (cut) continue;  // what earlier runs left was little
    EXPECT_EQ(cut.error().code, ErrorCode::kCancelled);
  }
  const auto resumed = invert(dataset, options, &checkpoints);
  ASSERT_TRUE(resumed);
  EXPECT_EQ(resumed->material, whole->material);
  EXPECT_EQ(resumed->predicted, whole->predicted);
  EXPECT_EQ(resumed->channels[1].history, whole->channels[1].history);
  EXPECT_EQ(resumed->channels[1].grid_correction, whole->channels[1].grid_correction);
  EXPECT_EQ(resumed->channels[1].solves, whole->channels[1].solves);
}
INSTANTIATE_TEST_SUITE_P(GridCorrection, InterruptedInverseSolver, ::testing::Bool());

TEST(InverseSolver, StartsAgainFromADamagedOrForeignCheckpoint) {
  const Dataset dataset = make_synthetic_dataset(tiny());
  InverseOptions options;
  options.max_iterations = 2;
  const opaline::testing::TemporaryDirectory directory;
  const auto file = directory.path() / "reconstruction.checkpoint";
  const CheckpointStore checkpoints(
      system_files(), directory.path(), fingerprint(dataset, options));
  const auto first = invert(dataset, options, &checkpoints);
  ASSERT_TRUE(first);
  EXPECT_TRUE(checkpoints.load().finished[2]);
  InverseOptions others = options;
  others.regularization *= 2.0;
  EXPECT_FALSE(CheckpointStore(system_files(), directory.path(), fingerprint(dataset, others))
                   .load()
                   .finished[0]);
  std::filesystem::resize_file(file, std::filesystem::file_size(file) / 2);
  EXPECT_FALSE(checkpoints.load().finished[0]);
  const auto again = invert(dataset, options, &checkpoints);
  ASSERT_TRUE(again);
  EXPECT_EQ(again->material, first->material);
}

TEST(InverseSolver, LeavesOutWhatIsMasked) {
  Dataset dataset = make_synthetic_dataset(tiny());
  InverseOptions options;
  options.max_iterations = 3;
  const auto clean = invert(dataset, options);
  for (Illumination& i : dataset.illuminations) {
    i.mask.at(3, 3) = 0;
    for (int c = 0; c < kColorChannels; ++c) i.radiance.at(3, 3, c) = 1e6F;
  }
  const auto masked = invert(dataset, options);
  ASSERT_TRUE(clean && masked);
  EXPECT_NEAR(masked->held_out.error, clean->held_out.error, 0.01);
}

TEST(InverseSolver, NamesWhatIsWrongWithADataset) {
  Dataset dataset = make_synthetic_dataset(tiny());
  dataset.illuminations[1].radiance_variance.at(2, 2, 0) = 0.0F;
  const auto result = invert(dataset, {});
  ASSERT_FALSE(result);
  EXPECT_EQ(result.error().code, ErrorCode::kInvalidArgument);
  EXPECT_THAT(result.error().message, HasSubstr("illumination region_1"));
  EXPECT_THAT(result.error().message, HasSubstr("variance 0"));
}

TEST(InverseSolver, RefusesADatasetWithoutAUsableDatum) {
  Dataset dataset = make_synthetic_dataset(tiny());
  for (Illumination& i : dataset.illuminations) i.mask = Image<std::uint8_t>(8, 8, 1, 0);
  const auto result = invert(dataset, {});
  ASSERT_FALSE(result);
  EXPECT_THAT(result.error().message, HasSubstr("every cell is masked"));
}

TEST(InverseSolver, RefusesOptionsOutOfRange) {
  InverseOptions options;
  options.tolerance = 0.0;
  const auto result = invert(make_synthetic_dataset(tiny()), options);
  ASSERT_FALSE(result);
  EXPECT_EQ(result.error().message, "tolerance = 0; expected > 0 and < 1");
}

TEST(InverseSolver, SummarisesItselfAsJson) {
  const Dataset dataset = make_synthetic_dataset(tiny());
  InverseOptions options;
  options.max_iterations = 2;
  options.model = Model::kHeterogeneous;
  const auto result = invert(dataset, options);
  ASSERT_TRUE(result);
  const auto json = nlohmann::json::parse(summary_json(dataset, options, *result));
  EXPECT_EQ(json["channels"].size(), 3U);
  EXPECT_EQ(json["channels"][0]["history"].size(), 3U);
  EXPECT_EQ(json["channels"][0]["stop_reason"], "iteration_limit");
  ASSERT_EQ(json["channels"][0]["ladder"].size(), 2U);
  EXPECT_EQ(json["channels"][0]["ladder"][1]["model"], "heterogeneous");
  EXPECT_EQ(json["channels"][0]["ladder"][1]["why"], "asked for");
  EXPECT_EQ(json["channels"][0]["model_reason"], "the model was asked for");
  EXPECT_TRUE(json["channels"][0]["homogeneous"]["absorption_interval_95"].is_null());
  EXPECT_EQ(json["illuminations"][0]["name"], "region_0");
  EXPECT_GT(json["held_out"]["relighting_error"], 0.0);
}

}  // namespace
}  // namespace opaline::reconstruct
