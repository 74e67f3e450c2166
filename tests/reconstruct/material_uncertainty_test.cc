#include "reconstruct/material_uncertainty.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>

#include "reconstruct/host/host_solver.h"
#include "reconstruct/prediction.h"
#include "tests/support/synthetic_dataset.h"

namespace opaline::reconstruct {
namespace {

using ::testing::Each;
using ::testing::HasSubstr;
using ::testing::Le;
using ::testing::SizeIs;
using testing_support::make_synthetic_dataset;
using testing_support::synthetic_coefficients;

/// Hears how far the work is, and stops it where asked to.
class RecordingSink : public NullSink {
 public:
  void progress(const Progress& progress) override {
    told.push_back(progress);
    if (told.size() == stop_at) stop.request_stop();
  }
  std::vector<Progress> told;
  std::size_t stop_at = 0;  ///< 0: never
  std::stop_source stop;
};

class MaterialUncertaintyTest : public ::testing::Test {
 protected:
  MaterialUncertaintyTest() {
    const Block& b = options_.block;
    found_.material.block = b;
    found_.material.ior = options_.ior;
    for (int c = 0; c < kColorChannels; ++c) {
      ChannelCoefficients& channel = found_.material.channels[c];
      for (int k = 0; k < b.nz; ++k)
        for (int j = 0; j < b.ny; ++j)
          for (int i = 0; i < b.nx; ++i) {
            const Vec3 centre{(i + 0.5) * b.hx, (j + 0.5) * b.hy, (k + 0.5) * b.hz};
            const auto truth = synthetic_coefficients(options_, centre, c);
            channel.absorption.push_back(truth.absorption);
            channel.reduced_scattering.push_back(truth.reduced_scattering);
          }
      found_.channels[c].model = "heterogeneous";
    }
    found_.predicted = *predict(dataset_, found_.material, {}, *solver_, {});
  }

  Result<std::optional<UncertaintyResult>> compute() {
    return material_uncertainty(
        dataset_, {}, found_, small_, {*solver_, events_, clock_}, events_.stop.get_token());
  }

  testing_support::SyntheticOptions options_{.block = {8, 8, 6, 1.0, 1.0, 1.0}};
  Dataset dataset_ = make_synthetic_dataset(options_);
  InverseResult found_;
  PosteriorOptions small_{.diffusion_modes = 200, .absorption_modes = 60, .threads = 2};
  std::unique_ptr<diffusion::FluenceSolver> solver_ = host::make_host_solver({.threads = 2});
  RecordingSink events_;
  const SystemClock clock_;
};

TEST_F(MaterialUncertaintyTest, KnowsEveryChannelBetterThanBeforeAndTheSeenFaceBest) {
  const auto result = compute();
  ASSERT_TRUE(result) << result.error().message;
  ASSERT_TRUE(result->has_value());
  for (std::size_t c = 0; c < kColorChannels; ++c) {
    const ChannelUncertaintyReport& report = (*result)->channels[c];
    const ChannelUncertainty& cells = (*result)->material[c];
    EXPECT_THAT(cells.deviation.absorption, SizeIs(options_.block.cell_count()));
    EXPECT_THAT(cells.deviation.absorption, Each(Le(report.absorption.prior)));
    EXPECT_THAT(cells.deviation.diffusion, Each(Le(report.diffusion.prior)));
    EXPECT_THAT(cells.shift.reduced_scattering, SizeIs(options_.block.cell_count()));
    ASSERT_THAT(report.reduced_scattering.layers, SizeIs(6));
    EXPECT_LT(report.reduced_scattering.layers.front(), 0.5 * report.reduced_scattering.prior);
    EXPECT_GT(report.reduced_scattering.prior, report.reduced_scattering.amplitude);
    EXPECT_GT(report.determined_diffusion, 1.0);
    EXPECT_GT(report.solves, 0);
  }
}

// The seen face is z_max: the first layer is the last of the block's.
TEST_F(MaterialUncertaintyTest, CountsLayersFromTheSeenFace) {
  const auto result = compute();
  ASSERT_TRUE(result && result->has_value());
  const std::size_t layer = 64;
  const auto& cells = (*result)->material[1].deviation.reduced_scattering;
  double sum = 0.0;
  for (std::size_t i = cells.size() - layer; i < cells.size(); ++i) sum += cells[i] * cells[i];
  EXPECT_DOUBLE_EQ((*result)->channels[1].reduced_scattering.layers.front(),
                   std::sqrt(sum / static_cast<double>(layer)));
  EXPECT_DOUBLE_EQ((*result)->layer_mm, 1.0);
}

TEST_F(MaterialUncertaintyTest, HasNothingToAddToAHomogeneousMaterial) {
  for (ChannelReport& channel : found_.channels) channel.model = "homogeneous";
  const auto none = compute();
  ASSERT_TRUE(none) << none.error().message;
  EXPECT_FALSE(none->has_value());
  found_.channels[2].model = "layered";
  const auto some = compute();
  ASSERT_TRUE(some) << some.error().message;
  EXPECT_TRUE(some->has_value());
}

TEST_F(MaterialUncertaintyTest, TellsHowFarItIs) {
  ASSERT_TRUE(compute());
  ASSERT_THAT(events_.told, SizeIs(4));
  EXPECT_EQ(events_.told[1].step, "uncertainty");
  EXPECT_EQ(events_.told[1].detail["channel"], "green");
  EXPECT_TRUE(events_.told[1].seconds_left.has_value());
  EXPECT_DOUBLE_EQ(events_.told[3].fraction, 1.0);
}

TEST_F(MaterialUncertaintyTest, StopsWhenCancelled) {
  events_.stop_at = 2;  // as the green channel begins
  const auto result = compute();
  ASSERT_FALSE(result);
  EXPECT_EQ(result.error().code, ErrorCode::kCancelled);
  EXPECT_THAT(result.error().message, HasSubstr("green"));
  EXPECT_THAT(events_.told, SizeIs(2));
}

TEST_F(MaterialUncertaintyTest, WritesWhatTheReportShows) {
  const auto result = compute();
  ASSERT_TRUE(result && result->has_value());
  const auto json = to_json(**result);
  EXPECT_EQ(json["channels"][2]["channel"], "blue");
  EXPECT_EQ(json["channels"][2]["absorption"]["layers"].get<std::vector<double>>(),
            (*result)->channels[2].absorption.layers);
  ASSERT_TRUE((*result)->budget);
  EXPECT_GT((*result)->budget->undetermined, 0.0);
  EXPECT_EQ(json["error_budget"]["sum"].get<double>(), (*result)->budget->sum());
  EXPECT_EQ(json["channels"][0]["diffusion"]["amplitude"].get<double>(),
            (*result)->channels[0].diffusion.amplitude);
}

}  // namespace
}  // namespace opaline::reconstruct
