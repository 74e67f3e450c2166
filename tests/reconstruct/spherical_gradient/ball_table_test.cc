#include "reconstruct/spherical_gradient/ball_table.h"

#include <gtest/gtest.h>

#include <cmath>

#include "sim/ball_transport.h"

namespace opaline::reconstruct {
namespace {

TEST(BallTable, FollowsTheTracedBallsWithinTheirNoise) {
  const BallTable& table = BallTable::standard();
  EXPECT_LT(table.ratio_misfit(), 2.0);
  for (const BallTable::Row& row : BallTable::standard_rows()) {
    const BallTable::Light light = table.light(row.reduced_albedo, row.curvature);
    EXPECT_NEAR(light.ratio, row.ratio, 4.0 * row.ratio_deviation)
        << row.reduced_albedo << ", " << row.curvature;
    EXPECT_NEAR(light.reflectance,
                row.reflectance,
                0.01 * row.reflectance);  // as well as a white target is known
  }
}

TEST(BallTable, FindsWhatALightIsOf) {
  const BallTable& table = BallTable::standard();
  for (const double albedo : {0.6, 0.9, 0.97, 0.994})
    for (const double curvature : {0.04, 0.1, 0.25, 0.45}) {
      const BallTable::Light light = table.light(albedo, curvature);
      const BallTable::Found found = table.find(light.reflectance, light.ratio);
      ASSERT_EQ(found.end, BallTable::End::kFound) << albedo << ", " << curvature;
      EXPECT_NEAR(found.reduced_albedo, albedo, 1e-9);
      EXPECT_NEAR(found.curvature, curvature, 1e-8);
      const BallTable::Found near = table.find(0.98 * light.reflectance, 1.02 * light.ratio);
      const BallTable::Found sooner = table.find(light.reflectance, light.ratio, near);
      EXPECT_NEAR(sooner.reduced_albedo, albedo, 1e-9);
      EXPECT_NEAR(sooner.curvature, curvature, 1e-8);
    }
}

TEST(BallTable, SaysWhatErrorsOfThePicturesDo) {
  const BallTable& table = BallTable::standard();
  const auto [reflectance, ratio] = table.light(0.97, 0.2);
  const BallTable::Found found = table.find(reflectance, ratio);
  const auto log_decay = [](const BallTable::Found& f) {
    return 0.5 * std::log(3.0 * (1.0 - f.reduced_albedo));
  };
  const double step = 1e-6;
  const BallTable::Found brighter = table.find(reflectance + step, ratio);
  const BallTable::Found bent = table.find(reflectance, ratio + step);
  const std::array expected{(log_decay(brighter) - log_decay(found)) / step,
                            (log_decay(bent) - log_decay(found)) / step,
                            std::log(brighter.curvature / found.curvature) / step,
                            std::log(bent.curvature / found.curvature) / step};
  for (std::size_t n = 0; n < expected.size(); ++n)
    EXPECT_NEAR(found.sensitivity[n], expected[n], 1e-3 * std::abs(expected[n])) << n;
}

TEST(BallTable, RecognisesBallsThatAreNotInIt) {
  ThreadTeam team(2);
  for (const auto& [albedo, curvature] : {std::pair{0.85, 0.15}, {0.93, 0.25}, {0.97, 0.35}}) {
    const double decay = std::sqrt(3.0 * (1.0 - albedo));
    const auto traced =
        sim::trace_ball({albedo, 1.0 / (decay * curvature), 1.4}, 200'000, 77, team);
    ASSERT_TRUE(traced);
    const BallTable::Found found = BallTable::standard().find(traced->reflectance, traced->ratio);
    ASSERT_EQ(found.end, BallTable::End::kFound);
    EXPECT_NEAR(found.reduced_albedo, albedo, 0.02 * albedo);
    // D = g l_d / 3 at the same curvature
    const double g = std::sqrt(3.0 * (1.0 - found.reduced_albedo));
    EXPECT_NEAR(g * found.curvature, decay * curvature, 0.05 * decay * curvature);
  }
}

TEST(BallTable, TwoPrincipalCurvaturesBendAsTheirMeanAndSpreadAsTheirSquares) {
  const BallTable& table = BallTable::standard();
  constexpr double kAlbedo = 0.96;
  const double flat = std::log(table.light(kAlbedo, 0.0).ratio);
  const double linear = (std::log(table.light(kAlbedo, 1e-6).ratio) - flat) / 1e-6;
  const auto spread = [&](double x) {
    return std::log(table.light(kAlbedo, x).ratio) - flat - linear * x;
  };
  for (const double ball : {0.05, 0.15, 0.3})
    for (const double unevenness : {0.1, 1.0, 5.0}) {
      const auto light = table.light(kAlbedo, ball);
      const BallTable::Found found = table.find(light.reflectance, light.ratio);
      const double bent = table.curvature_where(found, unevenness);
      EXPECT_LT(bent, ball);
      EXPECT_NEAR(linear * bent + spread(bent * std::sqrt(1.0 + unevenness)),
                  linear * ball + spread(ball),
                  1e-6);
    }
}

TEST(BallTable, EvenlyBentSurfacesAreBalls) {
  const auto light = BallTable::standard().light(0.96, 0.2);
  const BallTable::Found found = BallTable::standard().find(light.reflectance, light.ratio);
  EXPECT_EQ(BallTable::standard().curvature_where(found, 0.0), found.curvature);
  EXPECT_EQ(BallTable::standard().curvature_where(found, -0.1), found.curvature);  // by noise
}

TEST(BallTable, TellsFlatSoftAndBrightSurfacesApart) {
  const BallTable& table = BallTable::standard();
  EXPECT_EQ(table.find(0.5, 1.40).end, BallTable::End::kFlat);
  EXPECT_EQ(table.find(0.5, 6.0).end, BallTable::End::kTooTranslucent);
  EXPECT_EQ(table.find(0.999, 1.46).end, BallTable::End::kTooBright);
  EXPECT_EQ(table.find(0.005, 1.6).end, BallTable::End::kTooDark);
  EXPECT_EQ(table.find(std::nan(""), 1.6).end, BallTable::End::kNoNumber);
  EXPECT_EQ(table.find(0.5, -1.0).end, BallTable::End::kNoNumber);
}

TEST(BallTable, RefusesTooFewBalls) {
  EXPECT_FALSE(BallTable::make(BallTable::standard_rows().first(10)));
  EXPECT_FALSE(BallTable::make({}));
}

// Traced at an index between those of the tables. The tolerances: the fit's 0.3 % (as at the traced indices) and four deviations of the ball's own noise.
TEST(BallTable, HoldsForIndicesBetweenThoseThatWereTraced) {
  ThreadTeam team(2);
  const double decay = std::sqrt(3.0 * 0.05);
  const sim::BallLight traced =
      *sim::trace_ball({0.95, 1.0 / (decay * 0.2), 1.35}, 200'000, 77, team);
  const BallTable::Light light = BallTable::of_index(1.35)->light(0.95, 0.2);
  EXPECT_NEAR(light.reflectance,
              traced.reflectance,
              0.003 * traced.reflectance + 4.0 * traced.reflectance_deviation);
  EXPECT_NEAR(light.ratio, traced.ratio, 0.003 * traced.ratio + 4.0 * traced.ratio_deviation);
  const BallTable::Light standard = BallTable::standard().light(0.95, 0.2);
  EXPECT_NEAR(BallTable::of_index(1.4)->light(0.95, 0.2).ratio, standard.ratio, 1e-9);
  EXPECT_FALSE(BallTable::of_index(1.6));
}

}  // namespace
}  // namespace opaline::reconstruct
