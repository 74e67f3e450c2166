#include "calibration/sensor_noise.h"

#include <gmock/gmock.h>

#include <cmath>
#include <vector>

#include "sim/sensor.h"

namespace opaline::calibration {
namespace {

using ::testing::HasSubstr;

constexpr int kWidth = 160;
constexpr int kHeight = 120;
constexpr CodeRange kRange{64.0, 4095.0};

sim::CameraOptics optics(double gain, double read_noise) {
  sim::CameraOptics o;
  o.model.width = kWidth;
  o.model.height = kHeight;
  o.gain_electrons_per_code = gain;
  o.read_noise_electrons = read_noise;
  o.full_well_electrons = 1e6;
  return o;
}

Image<std::uint16_t> flat(const sim::CameraOptics& o, double electrons, std::uint64_t key) {
  const Image<float> light(kWidth, kHeight, 3, static_cast<float>(electrons * 1e-9));
  return sim::Sensor(o, 5).read(light, 0.1, key);
}

Result<PhotonTransfer> measured(const sim::CameraOptics& o) {
  std::vector<Image<std::uint16_t>> frames;
  const double full = o.gain_electrons_per_code * 4031.0;
  for (const double share : {0.0, 0.01, 0.05, 0.2, 0.4, 0.6, 0.8}) {
    const std::uint64_t key = frames.size();
    frames.push_back(flat(o, share * full, key));
    frames.push_back(flat(o, share * full, key + 1));
  }
  std::vector<FramePair> pairs;
  for (std::size_t i = 0; i < frames.size(); i += 2) pairs.push_back({&frames[i], &frames[i + 1]});
  return photon_transfer(pairs, kRange, 1);
}

TEST(PhotonTransfer, FindsGainAndReadNoiseOfASimulatedSensor) {
  for (const double gain : {1.0, 2.5, 8.0}) {
    const auto found = measured(optics(gain, 4.0 * gain));
    ASSERT_TRUE(found) << found.error().message;
    // Within five of its own standard deviations, which are below what the 19200 differences of one level of light alone
    // would leave: sqrt(2/19200) of the gain.
    EXPECT_NEAR(found->electrons_per_code, gain, 5.0 * found->electrons_per_code_deviation);
    EXPECT_LT(found->electrons_per_code_deviation, std::sqrt(2.0 / 19200.0) * gain);
    // Pixels without light: 19200 differences, a standard deviation of 0.5 % of the read noise.
    EXPECT_NEAR(found->read_noise_electrons, 4.0 * gain, 0.03 * 4.0 * gain);
  }
}

TEST(PhotonTransfer, FindsTheReadNoiseOfAQuietSensor) {
  for (const double codes : {0.6, 1.2}) {  // 1.2: the simulated rig's own
    const auto found = measured(optics(2.5, 2.5 * codes));
    ASSERT_TRUE(found) << found.error().message;
    EXPECT_TRUE(found->read_noise_resolved);
    EXPECT_NEAR(found->read_noise_electrons, 2.5 * codes, 0.05 * 2.5 * codes);
  }
}

TEST(PhotonTransfer, SaysWhereRoundingHidesTheReadNoise) {
  const auto found = measured(optics(8.0, 2.0));
  ASSERT_TRUE(found) << found.error().message;
  EXPECT_FALSE(found->read_noise_resolved);
  EXPECT_EQ(found->read_noise_electrons, 0.5 * found->electrons_per_code);
  EXPECT_NEAR(found->electrons_per_code, 8.0, 0.02 * 8.0);
}

TEST(PhotonTransfer, IsNotMisledByHotPixels) {
  sim::CameraOptics o = optics(2.5, 10.0);
  o.hot_pixel_fraction = 0.02;
  o.hot_pixel_electrons_per_second = 20000.0;
  const auto found = measured(o);
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->electrons_per_code, 2.5, 0.02 * 2.5);
  EXPECT_NEAR(found->read_noise_electrons, 10.0, 0.05 * 10.0);
}

// A board before a black room: what little is lit next to black must not lose its noise to what is not. 2 % as for hot pixels.
TEST(PhotonTransfer, IsNotMisledByAPictureThatIsMostlyDark) {
  const sim::CameraOptics o = optics(2.5, 3.0);
  Image<float> light(kWidth, kHeight, 3);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      const double share = std::pow(std::max(0.0, (x - 120.0) / 40.0), 3);
      for (int c = 0; c < 3; ++c) light.at(x, y, c) = static_cast<float>(8000.0e-9 * share);
    }
  }
  const sim::Sensor sensor(o, 5);
  std::vector<Image<std::uint16_t>> frames;
  for (std::uint64_t key = 0; key < 24; ++key) {
    const std::uint64_t halvings = key / 6;
    const double scale = std::pow(0.5, static_cast<double>(halvings));
    Image<float> scaled = light;
    for (float& v : scaled.samples()) v *= static_cast<float>(scale);
    frames.push_back(sensor.read(scaled, 0.1, key));
  }
  std::vector<FramePair> pairs;
  for (std::size_t i = 0; i < frames.size(); i += 2) pairs.push_back({&frames[i], &frames[i + 1]});
  const auto found = photon_transfer(pairs, kRange, 1);
  ASSERT_TRUE(found) << found.error().message;
  EXPECT_NEAR(found->electrons_per_code, 2.5, 0.02 * 2.5);
  EXPECT_NEAR(found->read_noise_electrons, 3.0, 0.05 * 3.0);
}

TEST(PhotonTransfer, RefusesPicturesWithoutNoise) {
  const Image<std::uint16_t> dim(kWidth, kHeight, 3, 100);
  const Image<std::uint16_t> middle(kWidth, kHeight, 3, 900);
  const Image<std::uint16_t> bright(kWidth, kHeight, 3, 2500);
  const std::vector<FramePair> pairs{{&dim, &dim}, {&middle, &middle}, {&bright, &bright}};
  const auto found = photon_transfer(pairs, kRange, 0);
  ASSERT_FALSE(found);
  EXPECT_THAT(found.error().message, HasSubstr("does not grow with the light"));
}

TEST(DarkFrame, TellsTemporalNoiseFromFixedPattern) {
  sim::CameraOptics o = optics(1.0, 5.0);
  o.hot_pixel_fraction = 0.0;
  std::vector<Image<std::uint16_t>> frames;
  for (std::uint64_t key = 0; key < 8; ++key) frames.push_back(flat(o, 0.0, key));
  for (Image<std::uint16_t>& frame :
       frames) {  // even columns lie four codes higher: a pattern of 2 about its mean
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; x += 2) {
        for (int c = 0; c < 3; ++c)
          frame.at(x, y, c) = static_cast<std::uint16_t>(frame.at(x, y, c) + 4);
      }
    }
  }
  std::vector<const Image<std::uint16_t>*> pointers;
  for (const auto& frame : frames) pointers.push_back(&frame);
  const auto dark = measure_dark(pointers);
  ASSERT_TRUE(dark);
  EXPECT_NEAR(
      dark->temporal, std::sqrt(25.0 + 0.1 + 1.0 / 12.0), 0.05);  // read, leak, quantisation
  EXPECT_NEAR(dark->fixed_pattern, 2.0, 0.05);
  EXPECT_NEAR(dark->level, 66.1, 0.3);
}

TEST(DarkFrame, FindsTheHotPixelsAndOnlyThose) {
  sim::CameraOptics o = optics(1.0, 3.0);
  o.hot_pixel_fraction = 0.01;
  o.hot_pixel_electrons_per_second = 2000.0;  // 200 in a tenth of a second
  const Image<std::uint16_t> a = flat(o, 0.0, 1);
  const Image<std::uint16_t> b = flat(o, 0.0, 2);
  const std::vector<const Image<std::uint16_t>*> frames{&a, &b};
  const auto dark = measure_dark(frames);
  ASSERT_TRUE(dark);
  const Image<std::uint16_t> bright = [&] {
    sim::CameraOptics clean = o;
    clean.read_noise_electrons = 0.0;
    return flat(clean, 0.0, 3);
  }();
  for (std::size_t i = 0; i < dark->hot.samples().size(); ++i) {
    EXPECT_EQ(dark->hot.samples()[i] != 0, bright.samples()[3 * i] > 64 + 100) << i;
  }
}

TEST(DarkFrame, WantsTwoFramesAlike) {
  const Image<std::uint16_t> a(4, 4, 3);
  const Image<std::uint16_t> b(5, 4, 3);
  const std::vector<const Image<std::uint16_t>*> one{&a};
  const std::vector<const Image<std::uint16_t>*> unlike{&a, &b};
  EXPECT_FALSE(measure_dark(one));
  EXPECT_FALSE(measure_dark(unlike));
}

}  // namespace
}  // namespace opaline::calibration
