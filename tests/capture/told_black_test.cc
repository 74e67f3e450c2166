#include "capture/told_black.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "sim/sensor.h"

namespace opaline::capture {
namespace {

constexpr int kWidth = 128;
constexpr int kHeight = 96;
constexpr double kShort = 1.0 / 30;
constexpr double kLong = 2.0;
constexpr double kWhite = 40'000.0;  // electrons a second
constexpr double kSensitivity = 1e9;
constexpr int kWhiteFrames = 8;

/// A simulated sensor before a sample with veins and an outline, under white light and under the little that its lamp sends at code 0.
class ToldBlackTest : public ::testing::Test {
 protected:
  ToldBlackTest() : seen_(kWidth, kHeight, 1) {
    optics_.model.width = kWidth;
    optics_.model.height = kHeight;
    optics_.hot_pixel_fraction = 0.0;
    optics_.vignetting = {};
    camera_.model = optics_.model;
    camera_.full_well_electrons = optics_.full_well_electrons;
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x)
        seen_.at(x, y) = std::hypot(x - 64.0, y - 48.0) < 45.0 ? 1 : 0;
    }
  }

  double white(int x, int y, int c) const {
    return white_ * (1.0 - 0.2 * c) *
           (1.0 + veins_ * std::sin(0.9 * x + 0.2 * y) * std::cos(0.5 * y));
  }
  double black(int x, int y, int c) const {  // above dark current
    const double u = 2.0 * (x + 0.5) / kWidth - 1.0;
    return white(x, y, c) * 1e-3 * (1.0 + 0.2 * u) +
           stray_ * std::exp(-0.02 * (std::pow(x - 50.0, 2.0) + std::pow(y - 40.0, 2.0)));
  }

  template <class Rate>
  Image<std::uint16_t> frame(double seconds, std::uint64_t key, Rate rate) const {
    Image<float> light(kWidth, kHeight, 3);
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x) {
        for (int c = 0; c < 3; ++c)
          light.at(x, y, c) = static_cast<float>(seconds * rate(x, y, c) / kSensitivity);
      }
    }
    return sim::Sensor(optics_, 7).read(light, seconds, key);
  }

  /// By noise of its own.
  std::optional<ToldBlack> tell(std::uint64_t seed) {
    const auto dark = [this](int x, int y, int c) { return black(x, y, c); };
    const auto lit = [this](int x, int y, int c) { return white(x, y, c) + black(x, y, c); };
    std::vector<Image<std::uint16_t>> whites;
    for (int i = 0; i < kWhiteFrames; ++i)
      whites.push_back(frame(kShort, sim::mix(seed, 10 + static_cast<std::uint64_t>(i)), lit));
    const auto short_black = frame(kShort, sim::mix(seed, 1), dark);
    const auto long_black = frame(kLong, sim::mix(seed, 2), dark);
    std::vector<ExposurePair> pairs;
    for (const auto& one : whites) pairs.push_back({&one, &short_black, kShort, kShort});
    const std::vector<const Image<std::uint16_t>*> blacks{&long_black};
    return tell_black(camera_, blacks, kLong, pairs, seen_);
  }

  /// Mean of squares of what is told less the truth, and of the noise of one frame.
  std::array<double, 2> squares(const ToldBlack& told) const {
    double off = 0.0;
    double noise = 0.0;
    double n = 0.0;
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x) {
        for (int c = 0; c < 3; ++c) {
          if (seen_.at(x, y) == 0) continue;
          const double truth = kLong * (black(x, y, c) + optics_.dark_electrons_per_second);
          off += std::pow(told.electrons.at(x, y, c) - truth, 2.0);
          noise += truth + 9.0 + 2.5 * 2.5 / 12.0;
          n += 1.0;
        }
      }
    }
    return {off / n, noise / n};
  }

  sim::CameraOptics optics_;
  CameraCalibration camera_;
  Image<std::uint8_t> seen_;
  double white_ = kWhite;
  double veins_ = 0.3;
  double stray_ = 0.0;
};

TEST_F(ToldBlackTest, KnowsTheBlackAsWellAsItSays) {
  constexpr int kRepeats = 20;
  double off = 0.0;
  double noise = 0.0;
  double worth = 0.0;
  for (std::uint64_t seed = 1; seed <= kRepeats; ++seed) {
    const auto told = tell(seed);
    ASSERT_TRUE(told);
    const auto [own_off, own_noise] = squares(*told);
    off += own_off / kRepeats;
    noise += own_noise / kRepeats;
    worth += told->blacks / static_cast<double>(kRepeats);
  }
  EXPECT_GT(worth, 30.0);
  EXPECT_GT(noise / off, worth);  // the seven numbers count for the 16 pixels of a cell
  // What is left is white's noise, that of the one short black frame which it is above, and seven numbers of some 6400 pixels.
  const double slope = 1e-3 * kLong;
  const double of_white = kWhite * 0.8 / (kWhiteFrames * kShort);
  const double of_reading = (9.0 + 2.5 * 2.5 / 12.0 + 1.4) / (kShort * kShort);
  const double expected = slope * slope * (of_white + of_reading) + noise * 7.0 / 6400.0;
  EXPECT_NEAR(off, expected, 0.1 * expected);
}

// Light without structure and what does not come from the projector cannot be told apart, and need not be.
TEST_F(ToldBlackTest, TellsTheBlackOfEvenWhiteToo) {
  veins_ = 0.0;
  const auto told = tell(1);
  ASSERT_TRUE(told);
  const auto [off, noise] = squares(*told);
  EXPECT_GT(noise / off, told->blacks);
}

TEST_F(ToldBlackTest, LeavesPixelsThatDoNotSeeTheSampleUntold) {
  const auto told = tell(1);
  ASSERT_TRUE(told);
  EXPECT_TRUE(std::isnan(told->electrons.at(0, 0, 0)));
  EXPECT_TRUE(std::isfinite(told->electrons.at(64, 48, 2)));
}

// Some light beside: 5 electrons a second in its middle, an eighth of the black, over some 10 pixels.
TEST_F(ToldBlackTest, SeesThatTheBlackIsNotAShareOfWhite) {
  stray_ = 5.0;
  EXPECT_FALSE(tell(1));
}

TEST_F(ToldBlackTest, DoesNotTellByWhiteThatClips) {
  white_ = 400'000.0;
  EXPECT_FALSE(tell(1));
}

TEST_F(ToldBlackTest, DoesNotTellByAFewPixels) {
  seen_ = Image<std::uint8_t>(kWidth, kHeight, 1);
  for (int x = 0; x < 100; ++x) seen_.at(x, 40) = 1;
  EXPECT_FALSE(tell(1));
}

}  // namespace
}  // namespace opaline::capture
