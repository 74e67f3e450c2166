#include "capture/steadiness.h"

#include <gmock/gmock.h>

#include <array>
#include <cmath>
#include <functional>
#include <random>

namespace opaline::capture {
namespace {

using ::testing::HasSubstr;

constexpr int kWidth = 96;
constexpr int kHeight = 64;
const std::vector<double> kSeconds{1.0 / 30.0, 4.0 / 30.0, 16.0 / 30.0, 64.0 / 30.0};

/// Electrons a second at a place of the picture, px.
using Scene = std::function<double(double x, double y)>;

// A spot of light that spreads in wax, from saturated in the third exposure to under the read noise in the first.
double spot(double x, double y) {
  const double r = std::hypot(x - 40.0, y - 30.0);
  return 4e4 * std::exp(-r / 9.0) + 300.0;
}

struct Taken {
  double light = 1.0;  ///< of the lamp
  double dx = 0.0;     ///< of the picture, px
  double seconds_off = 1.0;
  double gamma_off = 1.0;  ///< of the response's exponent
  bool hand = false;       ///< before 12 x 12 px, dims by a tenth
};

/// Takes brackets of the spot by the camera's model as calibration.h has it, with noise of its own.
class Bench {
 public:
  explicit Bench(double gamma = 1.0, CameraCalibration camera = {}) : camera_(std::move(camera)) {
    camera_.model.width = kWidth;
    camera_.model.height = kHeight;
    if (gamma != 1.0) camera_.response = {ResponseCurve::Kind::kGamma, gamma, {}};
    for (const double t : kSeconds)
      black_.push_back(expose([](double, double) { return 0.0; }, t, {}));
  }
  const CameraCalibration& camera() const { return camera_; }

  std::vector<TimedExposure> bracket(const std::vector<Taken>& taken, const Scene& scene = spot) {
    frames_.clear();
    frames_.reserve(taken.size());
    std::vector<TimedExposure> exposures;
    double clock = 0.0;
    for (std::size_t i = 0; i < taken.size(); ++i) {
      frames_.push_back(expose(scene, kSeconds[i], taken[i]));
      exposures.push_back(
          {{&frames_[i], &black_[i], kSeconds[i], kSeconds[i]}, i, clock + 0.5 * kSeconds[i]});
      clock += kSeconds[i] + 0.1;
    }
    return exposures;
  }
  SteadinessCheck::Verdict judge(const std::vector<Taken>& taken, const Scene& scene = spot) {
    return SteadinessCheck(camera_).judge(bracket(taken, scene), footprint_);
  }
  const Image<std::uint8_t>& footprint() const { return footprint_; }

 private:
  Image<std::uint16_t> expose(const Scene& scene, double seconds, const Taken& taken) {
    constexpr double kLeak = 20.0;
    Image<std::uint16_t> frame(kWidth, kHeight, 3);
    std::normal_distribution<double> read(0.0, camera_.read_noise_electrons);
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x) {
        const bool dim = taken.hand && x >= 52 && x < 64 && y >= 20 && y < 32;
        const double rate = taken.light * scene(x - taken.dx, y) * (dim ? 0.9 : 1.0) + kLeak;
        for (int c = 0; c < 3; ++c) {
          std::poisson_distribution<int> shot(rate * seconds * taken.seconds_off);
          const double well = camera_.full_well_electrons > 0.0 ? camera_.full_well_electrons : 1e9;
          const double electrons = std::min<double>(shot(random_), well) + read(random_);
          const double s = electrons / camera_.full_scale_electrons();
          const double gamma = camera_.response.kind == ResponseCurve::Kind::kGamma
                                   ? camera_.response.gamma * taken.gamma_off
                                   : 1.0;
          const double f = std::copysign(std::pow(std::abs(s), 1.0 / gamma), s);
          const double code = camera_.black_level + (camera_.max_code() - camera_.black_level) * f;
          frame.at(x, y, c) =
              static_cast<std::uint16_t>(std::clamp(std::round(code), 0.0, camera_.max_code()));
        }
      }
    }
    return frame;
  }
  CameraCalibration camera_;
  std::mt19937_64 random_{7};
  std::vector<Image<std::uint16_t>> black_;
  std::vector<Image<std::uint16_t>> frames_;
  Image<std::uint8_t> footprint_{kWidth, kHeight, 1, 1};
};

const std::vector<Taken> kSteady(4);

std::vector<Taken> with(std::size_t exposure, const Taken& taken) {
  std::vector<Taken> all(4);
  all[exposure] = taken;
  return all;
}
std::string kind_of(const SteadinessCheck::Verdict& verdict) {
  return verdict.unsteady ? std::string(to_string(verdict.unsteady->kind)) : "";
}

// At a rate of false alarms of 2 %, there would be none in 150 brackets with a probability of 5 %.
TEST(Steadiness, RaisesNoFalseAlarm) {
  Bench linear;
  for (int i = 0; i < 150; ++i) {
    const auto verdict = linear.judge(kSteady);
    EXPECT_FALSE(verdict.unsteady) << verdict.unsteady->message;
  }
  Bench curve(2.2);
  for (int i = 0; i < 30; ++i) {
    const auto verdict = curve.judge(kSteady);
    EXPECT_FALSE(verdict.unsteady) << verdict.unsteady->message;
  }
}

// Highlights of a few pixels that fill their wells just below the highest code, and codes so coarse that the read noise is rounded away.
TEST(Steadiness, RaisesNoFalseAlarmAtHighlightsNorByCoarseCodes) {
  CameraCalibration coarse;
  coarse.gain_electrons_per_code = 7.5;
  coarse.full_well_electrons = 30000.0;
  Bench bench(1.0, coarse);
  const Scene glossy = [](double x, double y) {
    const bool highlight = std::fmod(x, 11.0) < 1.0 && std::fmod(y, 13.0) < 2.0;
    return 0.1 * spot(x, y) + (highlight ? 3e6 : 0.0);
  };
  for (int i = 0; i < 40; ++i) {
    const auto verdict = bench.judge(kSteady, glossy);
    EXPECT_FALSE(verdict.unsteady) << verdict.unsteady->message;
  }
}

// Where light is about as strong as the noise, nothing but means over many pixels tell.
TEST(Steadiness, RaisesNoFalseAlarmInDimLight) {
  CameraCalibration coarse;
  coarse.gain_electrons_per_code = 7.5;
  Bench bench(1.0, coarse);
  const Scene dim = [](double x, double y) { return 0.002 * spot(x, y) + 12.0; };
  for (int i = 0; i < 40; ++i) {
    const auto verdict = bench.judge(kSteady, dim);
    EXPECT_FALSE(verdict.unsteady) << verdict.unsteady->message;
  }
}

// The lamp of a calibrated station may flicker by 0.5 %, and two exposures of it tell the light to 1 %.
TEST(Steadiness, FindsFlickerFromAnExposureToTheNext) {
  Bench bench;
  EXPECT_EQ(kind_of(bench.judge(with(1, {.light = 1.005}))), "");
  for (const double light : {0.985, 1.015, 1.05}) {
    for (std::size_t exposure = 0; exposure < 4; ++exposure) {
      const auto verdict = bench.judge(with(exposure, {.light = light}));
      ASSERT_EQ(kind_of(verdict), exposure == 1 || exposure == 2 ? "flicker" : kind_of(verdict));
      ASSERT_TRUE(verdict.unsteady) << light << " in exposure " << exposure;
      EXPECT_NEAR(
          verdict.unsteady->size, std::abs(std::log(light)), 5.0 * verdict.unsteady->deviation);
      EXPECT_LT(verdict.unsteady->deviation, 0.002);
    }
  }
}

TEST(Steadiness, FindsDriftOverTheExposures) {
  Bench bench;
  std::vector<Taken> fading(4);
  // Each lasts four times as long as the one before: over time a lamp fades the faster in the shorter ones.
  for (const double per_second : {0.01, 0.02}) {
    double clock = 0.0;
    for (std::size_t i = 0; i < 4; ++i) {
      fading[i].light = 1.0 - per_second * (clock + 0.5 * kSeconds[i]);
      clock += kSeconds[i] + 0.1;
    }
    const auto verdict = bench.judge(fading);
    ASSERT_TRUE(verdict.unsteady) << per_second;
    EXPECT_EQ(verdict.unsteady->kind, Unsteadiness::kDrift) << verdict.unsteady->message;
    EXPECT_THAT(verdict.unsteady->message, HasSubstr("fell"));
    const double fallen = std::log(fading[0].light / fading[3].light);
    EXPECT_LT(verdict.unsteady->deviation, 0.002);
    EXPECT_NEAR(verdict.unsteady->size, fallen, 5.0 * verdict.unsteady->deviation);
  }
}

// The spot's light changes by 11 % a pixel.
TEST(Steadiness, FindsAPictureThatHasMoved) {
  Bench bench;
  EXPECT_EQ(kind_of(bench.judge(with(2, {.dx = 0.03}))), "");
  for (const double dx : {0.2, -0.5, 1.5}) {
    std::vector<Taken> moved(4);
    moved[2].dx = moved[3].dx = dx;
    const auto verdict = bench.judge(moved);
    ASSERT_EQ(kind_of(verdict), "motion") << dx;
    EXPECT_NEAR(verdict.unsteady->shift_px, std::abs(dx), 0.15 * std::abs(dx))
        << verdict.unsteady->message;
  }
}

TEST(Steadiness, FindsAHandInTheWayAndSaysWhere) {
  Bench bench;
  const auto verdict = bench.judge(with(1, {.hand = true}));
  ASSERT_EQ(kind_of(verdict), "motion");
  ASSERT_TRUE(verdict.unsteady->where) << verdict.unsteady->message;
  EXPECT_NEAR(verdict.unsteady->where->first, 58, 12);
  EXPECT_NEAR(verdict.unsteady->where->second, 26, 12);
}

// A lamp's flicker is not the same in each take.
TEST(Steadiness, TakesWhatIsTheSameEachTimeForTheCalibrationsError) {
  Bench bench;
  SteadinessCheck check(bench.camera());
  const std::vector<Taken> longer = with(2, {.seconds_off = 1.04});
  EXPECT_EQ(kind_of(check.judge(bench.bracket(longer), bench.footprint())), "flicker");
  EXPECT_EQ(kind_of(check.judge(bench.bracket(longer), bench.footprint())), "flicker");
  const auto third = check.judge(bench.bracket(longer), bench.footprint());
  EXPECT_EQ(kind_of(third), "");
  EXPECT_THAT(third.disagreement, HasSubstr("calibrate"));
  check.next_light();  // known from now on
  const auto other = check.judge(bench.bracket(longer), bench.footprint());
  EXPECT_EQ(kind_of(other), "");
  EXPECT_EQ(other.disagreement, "");
  EXPECT_EQ(kind_of(check.judge(bench.bracket(kSteady), bench.footprint())), "flicker");
}

TEST(Steadiness, TakesThreeDifferentFlickersForThat) {
  Bench bench;
  SteadinessCheck check(bench.camera());
  for (const double light : {1.02, 0.97, 1.03, 0.98}) {
    EXPECT_EQ(kind_of(check.judge(bench.bracket(with(2, {.light = light})), bench.footprint())),
              "flicker");
  }
}

TEST(Steadiness, TellsAWrongResponseFromMotion) {
  Bench bench(2.2);
  std::vector<Taken> wrong(4);
  for (Taken& taken : wrong) taken.gamma_off = 1.3;
  const auto verdict = bench.judge(wrong);
  ASSERT_TRUE(verdict.unsteady);
  EXPECT_NE(verdict.unsteady->kind, Unsteadiness::kMotion) << verdict.unsteady->message;
}

// An even picture tells nothing of a shift, nor of levels.
TEST(Steadiness, LooksAtAnEvenPicture) {
  Bench bench;
  const Scene even = [](double, double) { return 900.0; };
  for (int i = 0; i < 30; ++i) EXPECT_EQ(kind_of(bench.judge(kSteady, even)), "");
  EXPECT_EQ(kind_of(bench.judge(with(2, {.light = 1.02}), even)), "flicker");
}

}  // namespace
}  // namespace opaline::capture
