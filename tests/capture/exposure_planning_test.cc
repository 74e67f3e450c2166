#include "capture/exposure_planning.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

namespace opaline::capture {
namespace {

constexpr double kTurn = 1.0 / 30.0;

std::array<CellLight, 3> grey(double rate, double pixels = 16.0, double leak = 0.0) {
  return {CellLight{rate, leak, rate + leak, pixels},
          CellLight{rate, leak, rate + leak, pixels},
          CellLight{rate, leak, rate + leak, pixels}};
}

// Written out once more, by the equation of the header.
double snr_squared(const ExposureProblem& p, const CellLight& c, const std::vector<int>& frames) {
  double sum = 0.0;
  for (std::size_t k = 0; k < frames.size(); ++k) {
    const double t = p.seconds[k];
    const double full = c.brightest * t;
    if (frames[k] == 0 || full + 3.0 * std::sqrt(full + p.read_variance) > p.clipping_electrons)
      continue;
    const double light = (c.rate + c.leak) * t + p.read_variance;
    sum += c.pixels * std::pow(c.rate * t, 2) / (light / frames[k] + c.leak * t + p.read_variance);
  }
  return sum;
}

bool is_enough(const ExposureProblem& p, const std::vector<int>& frames) {
  std::size_t enough = 0;
  for (const auto& cell : p.cells) {
    if (std::ranges::all_of(cell, [&](const CellLight& c) {
          return snr_squared(p, c, frames) >= c.wanted_snr * c.wanted_snr * (1.0 - 1e-12);
        }))
      ++enough;
  }
  return static_cast<double>(enough) >= p.share * static_cast<double>(p.cells.size()) - 1e-9;
}

// The least of all choices of up to seven frames each.
double least_of_all(const ExposureProblem& p) {
  double least = 1e9;
  std::vector<int> frames(3);
  for (frames[0] = 0; frames[0] < 8; ++frames[0]) {
    for (frames[1] = 0; frames[1] < 8; ++frames[1]) {
      for (frames[2] = 0; frames[2] < 8; ++frames[2]) {
        double seconds = 0.0;
        for (std::size_t k = 0; k < 3; ++k) seconds += frames[k] * p.seconds[k];
        if (seconds < least && is_enough(p, frames)) least = seconds;
      }
    }
  }
  return least;
}

TEST(PlanExposures, TakesNoMoreThanOnePerCentOverTheLeastOfAllChoices) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> decades(2.5, 4.5);
  int reached = 0;
  for (int trial = 0; trial < 20; ++trial) {
    ExposureProblem p;
    p.seconds = {kTurn, 4.0 * kTurn, 16.0 * kTurn};
    p.most_seconds = 3.0;
    for (int cell = 0; cell < 60; ++cell)
      p.cells.push_back(grey(std::pow(10.0, decades(random)), 16.0, 20.0));
    p.share = 0.8;
    const double least = least_of_all(p);
    const ExposureAnswer answer = plan_exposures(p);
    ASSERT_EQ(answer.reaches, least <= p.most_seconds) << trial;
    if (!answer.reaches) continue;
    ++reached;
    EXPECT_TRUE(is_enough(p, answer.frames)) << trial;
    EXPECT_LE(answer.seconds, least / 0.99 + 1e-9) << trial;
    EXPECT_LE(answer.bound, least + 1e-9) << trial;
  }
  EXPECT_GE(reached, 5);
}

TEST(PlanExposures, ExposesBrightCellsBrieflyAndDimOnesLong) {
  ExposureProblem p;
  p.seconds = {kTurn, 64.0 * kTurn};
  p.share = 1.0;
  p.cells = {grey(1e5), grey(400.0)};  // 1e5 electrons a second fill a pixel of 1e4 in 0.1 s
  const ExposureAnswer answer = plan_exposures(p);
  ASSERT_TRUE(answer.reaches);
  EXPECT_EQ(answer.frames, (std::vector<int>{1, 1}));
}

TEST(PlanExposures, AveragesFramesWhereOneWouldClip) {
  ExposureProblem p;
  p.seconds = {kTurn, 4.0 * kTurn};
  p.cells = {grey(2e5, 1.0)};  // 6667 electrons in the shortest, SNR 78 at most
  p.share = 1.0;
  p.blacks = {8, 8};
  const ExposureAnswer answer = plan_exposures(p);
  ASSERT_TRUE(answer.reaches);
  EXPECT_EQ(answer.frames, (std::vector<int>{2, 0}));
}

TEST(PlanExposures, CountsWhatWasTakenBefore) {
  ExposureProblem p;
  p.seconds = {kTurn};
  p.cells = {grey(2e5, 1.0)};
  p.share = 1.0;
  p.blacks = {8};
  p.taken = {1};
  EXPECT_EQ(plan_exposures(p).frames, std::vector<int>{1});
  p.taken = {2};
  EXPECT_EQ(plan_exposures(p).frames, std::vector<int>{0});
  EXPECT_DOUBLE_EQ(share_reached(p), 1.0);
}

TEST(PlanExposures, SaysWhatIsOutOfReach) {
  ExposureProblem p;
  p.seconds = {kTurn, 8.0};
  p.cells = {grey(1.0)};
  p.most_seconds = 10.0;
  const ExposureAnswer answer = plan_exposures(p);
  EXPECT_FALSE(answer.reaches);
  EXPECT_GT(answer.bound, p.most_seconds);
}

// SNR^2 = p r t for light alone; the leak's photons add theirs: t = SNR^2 (r + l) / (p r^2).
TEST(PhotonLimit, IsTheTimeInWhichEnoughPhotonsCome) {
  ExposureProblem p;
  p.seconds = {kTurn};
  for (int i = 1; i <= 100; ++i) p.cells.push_back(grey(10.0 * i, 10.0));
  EXPECT_NEAR(photon_limit(p), 1e4 / (10.0 * 60.0), 1e-9);  // the sixth darkest of 100
  for (auto& cell : p.cells) {
    for (CellLight& c : cell) c.leak = c.rate;
  }
  EXPECT_NEAR(photon_limit(p), 2e4 / (10.0 * 60.0), 1e-9);
}

}  // namespace
}  // namespace opaline::capture
