#include "reconstruct/spherical_gradient/window_fit.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace opaline::reconstruct {
namespace {

constexpr int kSize = 101;
constexpr int kMiddle = 50;
constexpr double kRadius = 60.0;  // pixels

std::size_t index_of(int x, int y) { return static_cast<std::size_t>(y) * kSize + x; }

/// A ball's normals, with Gaussian noise.
PixelValues ball(double noise, unsigned seed = 1) {
  ThreadTeam team(1);
  PixelValues p(kSize, kSize, team);
  std::mt19937 random(seed);
  std::normal_distribution<double> gaussian(0.0, 1.0);
  for (int y = 0; y < kSize; ++y)
    for (int x = 0; x < kSize; ++x) {
      const std::size_t at = p.index(x, y);
      const double i = x - kMiddle;
      const double j = y - kMiddle;
      p.normal_x[at] = static_cast<float>(i / kRadius + noise * gaussian(random));
      p.normal_y[at] = static_cast<float>(j / kRadius + noise * gaussian(random));
      p.normal_variance[at] = static_cast<float>(noise * noise);
      p.ratio[at] = 1.5F;
      p.ratio_variance[at] = 0.01F;
      p.measured[at] = i * i + j * j < 0.64 * kRadius * kRadius ? 1 : 0;
    }
  return p;
}

std::vector<WindowValues> windows(const PixelValues& p, int half, int threads = 1) {
  std::vector<WindowValues> all(p.measured.size());
  ThreadTeam team(threads);
  for_each_window(
      p, half, team, [&](int x, int y, const WindowValues& w) { all[p.index(x, y)] = w; });
  return all;
}

TEST(WindowFit, FindsABallsCurvatureInWindowsOfAnySizeAtAnyPlace) {
  const PixelValues p = ball(0.0);
  for (const int half : {1, 3, 17, 200}) {
    const auto all = windows(p, half);
    for (const WindowValues& window : all) {
      if (window.count < 6) continue;
      EXPECT_NEAR(window.curvature, 1.0 / kRadius, 1e-7);
    }
  }
}

TEST(WindowFit, TellsACylinderFromABall) {
  PixelValues p = ball(0.0);
  for (float& n : p.normal_y) n = 0.0F;
  const WindowValues w = windows(p, 6)[p.index(kMiddle, kMiddle)];
  EXPECT_NEAR(w.curvature, 0.5 / kRadius, 1e-7);
  EXPECT_NEAR(w.unevenness, 0.25 / (kRadius * kRadius), 1e-9);
  EXPECT_NEAR(windows(ball(0.0), 6)[p.index(kMiddle, kMiddle)].unevenness, 0.0, 1e-9);
}

TEST(WindowFit, NoiseMakesUnevennessNeitherLargerNorSmallerOnAverage) {
  constexpr int kDraws = 200;
  const std::size_t middle = index_of(kMiddle, kMiddle);
  double sum = 0.0;
  double squares = 0.0;
  for (unsigned seed = 0; seed < kDraws; ++seed) {
    const double u = windows(ball(0.05, seed), 5)[middle].unevenness;
    sum += u / kDraws;
    squares += u * u / kDraws;
  }
  EXPECT_LT(std::abs(sum), 4.0 * std::sqrt(squares / kDraws));
}

TEST(WindowFit, StatesTheCurvaturesUncertainty) {
  constexpr int kDraws = 200;
  const std::size_t middle = index_of(kMiddle, kMiddle);
  double squares = 0.0;
  double stated = 0.0;
  for (unsigned seed = 0; seed < kDraws; ++seed) {
    const WindowValues w = windows(ball(0.02, seed), 5)[middle];
    squares += std::pow(w.curvature - 1.0 / kRadius, 2) / kDraws;
    stated += w.curvature_variance / kDraws;
  }
  EXPECT_NEAR(squares / stated, 1.0, 4.0 * std::sqrt(2.0 / kDraws));
}

TEST(WindowFit, AMeanOfNPixelsIsSqrtOfNMoreCertain) {
  const WindowValues w = windows(ball(0.0), 2)[index_of(50, 50)];
  EXPECT_EQ(w.count, 25);
  EXPECT_NEAR(w.ratio, 1.5, 1e-9);
  EXPECT_NEAR(w.ratio_variance, 0.01 / 25.0, 1e-9);
}

TEST(WindowFit, LeavesOutWhatIsNotMeasured) {
  PixelValues p = ball(0.0);
  for (int y = 40; y < 60; ++y) {
    p.normal_x[p.index(50, y)] = 1e6F;
    p.measured[p.index(50, y)] = 0;
  }
  const auto all = windows(p, 4);
  EXPECT_NEAR(all[p.index(52, 50)].curvature, 1.0 / kRadius, 1e-7);
  EXPECT_EQ(all[p.index(52, 50)].count, 81 - 9);
  EXPECT_EQ(all[p.index(50, 50)].count, 0);
}

TEST(WindowFit, GivesTheSameHoweverManyThreadsShareThePicture) {
  const PixelValues p = ball(0.05);
  const auto one = windows(p, 6, 1);
  const auto three = windows(p, 6, 3);
  for (std::size_t at = 0; at < one.size(); ++at) {
    EXPECT_EQ(one[at].count, three[at].count);
    EXPECT_NEAR(one[at].curvature, three[at].curvature, 1e-10);
  }
}

}  // namespace
}  // namespace opaline::reconstruct
