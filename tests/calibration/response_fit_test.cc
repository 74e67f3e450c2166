#include "calibration/response_fit.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <vector>

#include "sim/sensor.h"

namespace opaline::calibration {
namespace {

using ::testing::HasSubstr;

constexpr int kWidth = 96;
constexpr int kHeight = 64;
const std::vector<double> kSeconds{
    1.0 / 60, 1.0 / 30, 2.0 / 30, 4.0 / 30, 8.0 / 30, 16.0 / 30, 32.0 / 30};

// A 400:1 ramp that the shortest exposure does not clip and the longest lifts out of the dark.
Image<float> ramp(double seconds) {
  Image<float> light(kWidth, kHeight, 3);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      const double share = (x + kWidth * (y % 8)) / (8.0 * kWidth);
      for (int c = 0; c < 3; ++c) {
        light.at(x, y, c) = static_cast<float>(seconds * 1e-5 * 20.0 *
                                               std::pow(400.0, share - 1.0) * (1.0 + 0.2 * c));
      }
    }
  }
  return light;
}

sim::CameraOptics optics(int bits, double gamma) {
  sim::CameraOptics o;
  o.model.width = kWidth;
  o.model.height = kHeight;
  o.response_gamma = gamma;
  o.bit_depth = bits;
  o.black_level = bits == 8 ? 4.0 : bits == 12 ? 64.0 : 1024.0;
  o.gain_electrons_per_code = 10000.0 / (o.max_code() - o.black_level);
  return o;
}

struct Stack {
  std::vector<Image<std::uint16_t>> frames;
  std::vector<double> seconds = kSeconds;  // as the camera says
  CodeRange range;

  Stack(const sim::CameraOptics& o, const std::vector<double>& true_seconds) {
    range = {o.black_level, o.max_code()};
    const sim::Sensor sensor(o, 7);
    for (std::size_t j = 0; j < true_seconds.size(); ++j) {
      frames.push_back(sensor.read(ramp(true_seconds[j]), true_seconds[j], sim::mix(11, j)));
    }
  }
  Result<ResponseFit> fit(int channel = 1) const {
    std::vector<Exposure> stack;
    for (std::size_t j = 0; j < frames.size(); ++j) stack.push_back({&frames[j], seconds[j]});
    return fit_response(stack, range, channel);
  }
};

double rms_error(const capture::ResponseCurve& curve, double gamma) {
  double squares = 0.0;
  for (int i = 5; i <= 95; ++i) {
    const double error = signal_at(curve, 0.01 * i) - std::pow(0.01 * i, gamma);
    squares += error * error;
  }
  return std::sqrt(squares / 91.0);
}

// The goal set for the station: 1 % of full scale over 5 to 95 % of the range.
constexpr double kGoal = 0.01;

// Exposures that only noise and stray samples tell of must not take up the freedom that response and times share.
TEST(ResponseFit, IsNotMisledByExposuresThatNextToNothingTellsOf) {
  std::vector<double> seconds = kSeconds;
  for (const double t : {1e-5, 3e-5, 20.0, 60.0, 180.0}) seconds.push_back(t);
  std::ranges::sort(seconds);
  const sim::CameraOptics o = optics(12, 2.2);
  Stack stack(o, seconds);
  stack.seconds = seconds;
  stack.range.floor = 0.12 * (o.max_code() - o.black_level);
  const auto fit = stack.fit();
  ASSERT_TRUE(fit) << fit.error().message;
  for (int i = 15; i <= 95; i += 10) {
    const double f = 0.01 * i;
    EXPECT_NEAR(signal_at(fit->curve, f), std::pow(f, 2.2), 0.01) << f;  // the goal of the issue
  }
}

TEST(ResponseFit, TakesExposuresThatLieClose) {
  std::vector<double> seconds;
  for (int j = 0; j < 44; ++j) seconds.push_back(std::pow(1.1, j) / 60.0);
  for (const double gamma : {1.0, 2.2}) {
    Stack stack(optics(8, gamma), seconds);
    stack.seconds = seconds;
    const auto fit = stack.fit();
    ASSERT_TRUE(fit) << fit.error().message;
    EXPECT_LT(rms_error(fit->curve, gamma), 0.01);
    EXPECT_LT(fit->pixels_refused, kWidth * kHeight / 50);
  }
}

TEST(ResponseFit, FindsTheResponseOfEachDepthAndChannelWithinAPercent) {
  for (const int bits : {8, 12, 16}) {
    for (const double gamma : {1.0, 1.8, 2.2}) {
      const Stack stack(optics(bits, gamma), kSeconds);
      for (const int channel : {0, 2}) {
        const auto fit = stack.fit(channel);
        ASSERT_TRUE(fit) << fit.error().message;
        EXPECT_LT(rms_error(fit->curve, gamma), kGoal) << bits << " bits, gamma " << gamma;
      }
    }
  }
}

TEST(ResponseFit, RisesEverywhereFromZeroToOne) {
  const auto fit = Stack(optics(8, 2.2), kSeconds).fit();
  ASSERT_TRUE(fit);
  EXPECT_EQ(fit->curve.table.front(), 0.0);
  EXPECT_EQ(fit->curve.table.back(), 1.0);
  for (std::size_t i = 1; i < fit->curve.table.size(); ++i) {
    EXPECT_GT(fit->curve.table[i], fit->curve.table[i - 1]);
  }
}

TEST(ResponseFit, MeasuresATimeThatTheCameraTellsWrong) {
  // A middle exposure 12 % longer than said. Of that error a constant and a multiple of ln t cannot be told from the response:
  // what is left of it in the middle of seven evenly spaced ones is 6/7.
  std::vector<double> truth = kSeconds;
  truth[3] *= 1.12;
  const Stack stack(optics(12, 1.0), truth);
  const auto fit = stack.fit();
  ASSERT_TRUE(fit);
  EXPECT_LT(rms_error(fit->curve, 1.0), kGoal);
  for (std::size_t j = 0; j < truth.size(); ++j) {
    const double expected = std::log(1.12) * ((j == 3 ? 1.0 : 0.0) - 1.0 / 7.0);
    EXPECT_NEAR(std::log(fit->seconds[j] / kSeconds[j]), expected, 0.01) << j;
  }
}

TEST(ResponseFit, IsNotMisledByATenthOfThePixelsHot) {
  sim::CameraOptics o = optics(12, 2.2);
  o.hot_pixel_fraction = 0.1;
  o.hot_pixel_electrons_per_second = 30000.0;
  Stack stack(o, kSeconds);
  for (Image<std::uint16_t>& frame : stack.frames) {
    for (std::size_t i = 0; i < frame.samples().size(); i += 20)
      frame.samples()[i] = 1500;  // stuck
  }
  const auto fit = stack.fit();
  ASSERT_TRUE(fit) << fit.error().message;
  EXPECT_LT(rms_error(fit->curve, 2.2), kGoal);
  EXPECT_GT(fit->pixels_refused, 100);
}

TEST(ResponseFit, TellsALinearSensorFromOneThatIsNot) {
  const auto linear = Stack(optics(12, 1.0), kSeconds).fit();
  const auto bent = Stack(optics(12, 1.1), kSeconds).fit();
  ASSERT_TRUE(linear && bent);
  EXPECT_LT(departure_from_line(linear->curve), 0.005);
  EXPECT_GT(departure_from_line(bent->curve), 0.005);
}

TEST(ResponseFit, RefusesWhatCannotTellAndSaysWhatWould) {
  Stack dark(optics(12, 1.0), std::vector<double>(7, 1e-5));
  ASSERT_FALSE(dark.fit());
  EXPECT_THAT(dark.fit().error().message, HasSubstr("another light"));

  Stack unsorted(optics(12, 1.0), kSeconds);
  std::swap(unsorted.seconds[2], unsorted.seconds[5]);
  ASSERT_FALSE(unsorted.fit());
  EXPECT_THAT(unsorted.fit().error().message, HasSubstr("sort them"));

  Stack stale(optics(12, 1.0), std::vector<double>(7, 0.1));  // the same exposure seven times
  ASSERT_FALSE(stale.fit());
  EXPECT_THAT(stale.fit().error().message, HasSubstr("stuck"));

  EXPECT_FALSE(Stack(optics(12, 1.0), kSeconds).fit(3));
}

}  // namespace
}  // namespace opaline::calibration
