#include "capture/exposure_plan.h"

#include <gmock/gmock.h>

namespace opaline::capture {
namespace {

using std::chrono::nanoseconds;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

constexpr nanoseconds kTurn{33'333'333};
constexpr ExposureLimits kStation{kTurn, std::chrono::microseconds(100), std::chrono::seconds(10)};

TEST(ExposureLadder, RisesInWholeTurnsFromAThirtiethToEightSeconds) {
  const auto ladder = exposure_ladder({}, kStation);
  ASSERT_TRUE(ladder) << ladder.error().message;
  EXPECT_THAT(*ladder, ElementsAre(kTurn, 4 * kTurn, 16 * kTurn, 64 * kTurn, 240 * kTurn));
}

TEST(ExposureLadder, RoundsTheShortestUpToAWholeTurn) {
  const auto ladder =
      exposure_ladder({.shortest = nanoseconds(40'000'000), .longest = 4 * kTurn}, kStation);
  ASSERT_TRUE(ladder);
  EXPECT_THAT(*ladder, ElementsAre(2 * kTurn, 4 * kTurn));
}

TEST(ExposureLadder, StaysWithinTheCamera) {
  const auto ladder = exposure_ladder({}, {kTurn, 3 * kTurn, 20 * kTurn});
  ASSERT_TRUE(ladder);
  EXPECT_THAT(*ladder, ElementsAre(3 * kTurn, 12 * kTurn, 20 * kTurn));
}

TEST(ExposureLadder, NeedsNoWheel) {
  const auto ladder = exposure_ladder(
      {.shortest = nanoseconds(1'000'000), .longest = nanoseconds(10'000'000), .ratio = 3.0},
      {nanoseconds(0), nanoseconds(1000), nanoseconds(1'000'000'000)});
  ASSERT_TRUE(ladder);
  EXPECT_THAT(*ladder,
              ElementsAre(nanoseconds(1'000'000),
                          nanoseconds(3'000'000),
                          nanoseconds(9'000'000),
                          nanoseconds(10'000'000)));
}

TEST(ExposureLadder, RefusesARatioThatTakesTooManyAndSaysWhichWouldDo) {
  for (const double ratio : {1.0001, 1.02, 1.05}) {
    const auto ladder =
        exposure_ladder({.ratio = ratio}, {nanoseconds(0), kTurn, kStation.longest});
    ASSERT_FALSE(ladder) << ratio;
    EXPECT_EQ(ladder.error().code, ErrorCode::kInvalidArgument);
    EXPECT_THAT(ladder.error().message, HasSubstr("ratio"));
    EXPECT_THAT(ladder.error().message, HasSubstr("at least 1.10"));
  }
  EXPECT_TRUE(exposure_ladder({.ratio = 1.10}, kStation));
}

TEST(ExposureLadder, RefusesALimitShorterThanATurn) {
  const auto ladder = exposure_ladder({.longest = nanoseconds(30'000'000)}, kStation);
  ASSERT_FALSE(ladder);
  EXPECT_THAT(ladder.error().message, HasSubstr("whole turn"));
}

ExposureStatistics at(double saturated, double snr) { return {saturated, snr}; }

TEST(Bracket, GoesShorterWhileSaturatedThenLongerWhileNoisy) {
  Bracket bracket({.wanted_snr = 30.0}, 5);
  EXPECT_EQ(bracket.next(), 2u);
  bracket.add(2, at(0.1, 10.0));
  EXPECT_EQ(bracket.next(), 1u);
  bracket.add(1, at(0.0, 5.0));
  EXPECT_EQ(bracket.next(), 3u);
  bracket.add(3, at(0.4, 35.0));
  EXPECT_EQ(bracket.next(), std::nullopt);
}

TEST(Bracket, TakesOneExposureWhenItIsGoodEnough) {
  Bracket bracket({.wanted_snr = 30.0}, 5);
  bracket.add(*bracket.next(), at(0.0, 31.0));
  EXPECT_EQ(bracket.next(), std::nullopt);
}

TEST(Bracket, EndsAtTheLimitsOfTheLadder) {
  Bracket bracket({.wanted_snr = 1e9}, 3);
  int taken = 0;
  while (const auto index = bracket.next()) {
    ASSERT_LT(taken++, 3);
    bracket.add(*index, at(1.0, 0.0));
  }
  EXPECT_EQ(taken, 3);
}

}  // namespace
}  // namespace opaline::capture
