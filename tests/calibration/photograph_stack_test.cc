// Stacks of photographs as cameras keep them, 8-bit JPEG of an unknown response, through a folder of photographs: the
// response is found from them (Debevec and Malik), and HDR merged with it shows the light that there was.

#include <OpenImageIO/imageio.h>
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <array>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <vector>

#include "base/clock.h"
#include "calibration/response_fit.h"
#include "capture/hdr_merge.h"
#include "drivers/replay/replay_camera.h"
#include "sim/sensor.h"
#include "tests/support/temporary_directory.h"

namespace opaline::calibration {
namespace {

namespace fs = std::filesystem;

constexpr int kWidth = 96;
constexpr int kHeight = 64;
constexpr double kGamma = 2.2;
constexpr double kBlack = 4.0;
constexpr double kFullScaleElectrons = 10000.0;
constexpr std::array kMilliseconds{17, 33, 67, 133, 267, 533, 1067};

/// Radiance, W/(mm^2 sr): 400 : 1 from corner to corner, by channel a fifth more.
double radiance(int x, int y, int channel) {
  const double share = (x + y) / static_cast<double>(kWidth + kHeight - 2);
  return 2e-4 * std::pow(400.0, share - 1.0) * (1.0 + 0.2 * channel);
}

sim::CameraOptics optics() {
  sim::CameraOptics o;
  o.model.width = kWidth;
  o.model.height = kHeight;
  o.bit_depth = 8;
  o.response_gamma = kGamma;
  o.black_level = kBlack;
  o.gain_electrons_per_code = kFullScaleElectrons / (o.max_code() - kBlack);
  return o;
}

Image<float> light(double seconds, bool lit) {
  Image<float> picture(kWidth, kHeight, 3);
  for (int y = 0; lit && y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x)
      for (int c = 0; c < 3; ++c)
        picture.at(x, y, c) = static_cast<float>(seconds * radiance(x, y, c));
  return picture;
}

void write_jpeg(const fs::path& path, const Image<std::uint16_t>& codes) {
  std::vector<std::uint8_t> bytes(codes.samples().begin(), codes.samples().end());
  OIIO::ImageSpec spec(kWidth, kHeight, 3, OIIO::TypeDesc::UINT8);
  spec.attribute("compression", "jpeg:97");
  spec.attribute("jpeg:subsampling", "4:4:4");
  const auto output = OIIO::ImageOutput::create(path.string());
  ASSERT_TRUE(output && output->open(path.string(), spec)) << OIIO::geterror();
  ASSERT_TRUE(output->write_image(OIIO::TypeDesc::UINT8, bytes.data())) << output->geterror();
  ASSERT_TRUE(output->close());
}

/// The scene and darkness, at every exposure.
void photograph(const fs::path& folder) {
  const sim::Sensor sensor(optics(), 7);
  std::ofstream index(folder / "index.toml");
  index << fmt::format("[camera]\nwidth = {}\nheight = {}\nbit_depth = 8\n", kWidth, kHeight);
  std::uint64_t key = 0;
  for (const int ms : kMilliseconds)
    for (const std::string scene : {"scene", "dark"}) {
      const std::string name = fmt::format("{}-{}.jpg", scene, ms);
      const double seconds = 1e-3 * ms;
      write_jpeg(folder / name, sensor.read(light(seconds, scene == "scene"), seconds, ++key));
      index << fmt::format("[[photograph]]\nfile = \"{}\"\npattern = \"{}\"\nexposure_s = {}\n",
                           name,
                           scene,
                           seconds);
    }
}

std::vector<Frame> replayed(const fs::path& folder, const std::string& scene) {
  const SystemClock clock;
  drivers::ReplayCamera camera(folder, clock);
  EXPECT_TRUE(camera.open());
  std::vector<Frame> frames;
  std::uint64_t trigger = 0;
  for (const int ms : kMilliseconds) {
    auto frame = camera.capture({std::chrono::milliseconds(ms), ++trigger, scene}, {});
    EXPECT_TRUE(frame) << frame.error().message;
    if (frame) frames.push_back(*std::move(frame));
  }
  return frames;
}

double seconds_of(const Frame& frame) {
  return std::chrono::duration<double>(frame.exposure).count();
}

TEST(PhotographStack, TellsTheResponseAndTheLightFromJpegs) {
  const testing::TemporaryDirectory folder;
  photograph(folder.path());
  const std::vector<Frame> lit = replayed(folder.path(), "scene");
  const std::vector<Frame> dark = replayed(folder.path(), "dark");
  ASSERT_EQ(lit.size(), kMilliseconds.size());
  ASSERT_EQ(dark.size(), kMilliseconds.size());

  std::vector<Exposure> stack;
  for (const Frame& frame : lit) stack.push_back({&frame.pixels, seconds_of(frame)});
  const auto fit = fit_response(stack, {kBlack, 255.0}, 1);
  ASSERT_TRUE(fit) << fit.error().message;
  double squares = 0.0;
  for (int i = 5; i <= 95; ++i)
    squares += std::pow(signal_at(fit->curve, 0.01 * i) - std::pow(0.01 * i, kGamma), 2.0);
  EXPECT_LT(std::sqrt(squares / 91.0), 0.01);  // what the station asks of a response

  capture::CameraCalibration camera;
  camera.model = optics().model;
  camera.bit_depth = 8;
  camera.black_level = kBlack;
  camera.gain_electrons_per_code = optics().gain_electrons_per_code;
  camera.response = fit->curve;
  camera.vignetting = {optics().vignetting};
  std::vector<capture::ExposurePair> pairs;
  for (std::size_t i = 0; i < lit.size(); ++i)
    pairs.push_back({&lit[i].pixels, &dark[i].pixels, seconds_of(lit[i]), seconds_of(dark[i])});
  const auto hdr = capture::HdrMerge(camera, Image<std::uint8_t>(kWidth, kHeight, 1)).merge(pairs);
  // Means of 8 x 8 pixels, over which noise is below a per cent.
  double squared = 0.0;
  for (int y = 0; y < kHeight; y += 8)
    for (int x = 0; x < kWidth; x += 8) {
      double seen = 0.0;
      double there = 0.0;
      for (int v = y; v < y + 8; ++v)
        for (int u = x; u < x + 8; ++u) {
          ASSERT_EQ(hdr.saturated.at(u, v, 0), 0) << u << ", " << v;
          seen += hdr.radiance.at(u, v, 1);
          there += radiance(u, v, 1);
        }
      EXPECT_NEAR(seen / there, 1.0, 0.03) << x << ", " << y;
      squared += std::pow(seen / there - 1.0, 2.0);
    }
  EXPECT_LT(std::sqrt(64.0 * squared / (kWidth * kHeight)), 0.01);
}

}  // namespace
}  // namespace opaline::calibration
