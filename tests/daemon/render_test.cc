// opaline render, as a user calls it.

#include <gmock/gmock.h>

#include <cmath>
#include <csignal>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "base/files.h"
#include "base/io/image_io.h"
#include "daemon/render/turntable.h"
#include "tests/support/named_directory.h"
#include "tests/support/process.h"
#include "tests/support/temporary_directory.h"

namespace opaline::daemon {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::HasSubstr;

constexpr std::string_view kScene = R"(name = "ball on a floor"
[picture]
width = 48
height = 36
samples = 2
white = 0.25
background = [0.5, 0.5, 0.5]
[camera]
position = ["0 mm", "-60 mm", "30 mm"]
[diffusion]
tetrahedra = 3000
[[lights]]
kind = "directional"
direction = [0.5, 1, -1]
irradiance = [1, 1, 1]
[[objects]]
name = "ball"
shape = "sphere"
size = "20 mm"
[objects.material]
absorption = [0.001, 0.01, 0.1]
reduced_scattering = [1, 1, 1]
[[objects]]
name = "floor"
kind = "opaque"
shape = "plane"
size = "60 mm"
position = ["0 mm", "0 mm", "-10 mm"]
)";

class RenderProgram : public ::testing::Test {
 protected:
  fs::path path(const std::string& name) const { return directory_.path() / name; }
  std::string scene(std::string_view what = "", std::string_view with = "") {
    std::string text(kScene);
    if (!what.empty()) text.replace(text.find(what), what.size(), with);
    EXPECT_TRUE(write_whole(system_files(), path("scene.toml"), std::string_view(text)));
    return path("scene.toml").string();
  }
  testing::Process start(std::vector<std::string> arguments) {
    const fs::path program = opaline::testing::named_directory("OPALINE_BIN_DIR") / "opaline";
    arguments.insert(arguments.begin(), {program.string(), "render"});
    return testing::Process(arguments, {}, path("out"));
  }
  ImageFile image(const std::string& name) const {
    const auto bytes = read_bytes(path(name), 1 << 24);
    EXPECT_TRUE(bytes) << name;
    auto file = decode_image(*bytes);
    EXPECT_TRUE(file) << name;
    return *std::move(file);
  }
  testing::TemporaryDirectory directory_;
};

double linear(double code) {
  return code <= 0.04045 ? code / 12.92 : std::pow((code + 0.055) / 1.055, 2.4);
}

TEST_F(RenderProgram, WritesRadianceAsExrAndTheSameAsPngThroughExposureAndWhite) {
  auto run = start({scene("white = 0.25", "white = 0.25\nexposure = 1"),
                    "--output",
                    path("a.exr").string(),
                    "--output",
                    path("a.png").string(),
                    "--stats",
                    path("a.json").string()});
  ASSERT_EQ(run.wait(), 0) << run.output();
  const ImageFile radiance_file = image("a.exr");
  const ImageFile shown_file = image("a.png");
  const auto& radiance = std::get<Image<float>>(radiance_file.pixels);
  const auto& shown = std::get<Image<std::uint8_t>>(shown_file.pixels);
  ASSERT_EQ(radiance.channels(), 4);
  int lit = 0;
  for (int y = 0; y < 36; ++y) {
    for (int x = 0; x < 48; ++x) {
      const double covered = radiance.at(x, y, 3);
      for (int c = 0; c < 3; ++c) {
        const double light = std::min(covered, 2.0 * radiance.at(x, y, c) / 0.25);
        const double wanted = light + 0.5 * (1.0 - covered);
        const double code = shown.at(x, y, c) / 255.0;
        EXPECT_LE(linear(code - 0.51 / 255.0), wanted + 1e-6);
        EXPECT_GE(linear(code + 0.51 / 255.0), wanted - 1e-6);
        lit += light > 0.1 ? 1 : 0;
      }
    }
  }
  EXPECT_GT(lit, 500);
  const auto stats = nlohmann::json::parse(read_text(path("a.json")).value());
  EXPECT_EQ(stats["objects"][0]["name"], "ball");
  EXPECT_LE(stats["objects"][0]["relative_residual"], 1e-4);
  EXPECT_GT(stats["seconds"]["draw"], 0.0);
  EXPECT_EQ(stats["white"], 0.25);
}

TEST_F(RenderProgram, ATurntableTurnsTheObjectsUnderLightsThatStandStill) {
  auto run = start({scene(), "--output", path("t.exr").string(), "--turntable", "2"});
  ASSERT_EQ(run.wait(), 0) << run.output();
  // A ball on a square floor looks the same after half a turn, but for how it was cut up.
  const ImageFile first_file = image("t_0.exr");
  const ImageFile second_file = image("t_1.exr");
  const auto& first = std::get<Image<float>>(first_file.pixels);
  const auto& second = std::get<Image<float>>(second_file.pixels);
  double difference = 0.0;
  double size = 0.0;
  for (std::size_t i = 0; i < first.samples().size(); ++i) {
    difference += std::abs(first.samples()[i] - second.samples()[i]);
    size += std::abs(first.samples()[i]);
  }
  EXPECT_LT(difference, 0.02 * size);
  EXPECT_FALSE(fs::exists(path("t.exr")));
}

TEST_F(RenderProgram, RefusesABadSceneOrOutputAndWritesNothing) {
  auto bad = start({scene("white", "wite"), "--output", path("b.png").string()});
  EXPECT_EQ(bad.wait(), 2);
  EXPECT_THAT(bad.output(),
              AllOf(HasSubstr("scene.toml:6:1: unknown key \"wite\""),
                    HasSubstr("did you mean \"white\"?")));
  auto format = start({scene(), "--output", path("b.jpg").string()});
  EXPECT_EQ(format.wait(), 2);
  EXPECT_THAT(format.output(), HasSubstr("b.jpg"));
  auto nowhere = start({scene(), "--output", path("no/b.png").string()});
  EXPECT_EQ(nowhere.wait(), 2);
  EXPECT_THAT(nowhere.output(), HasSubstr("no such directory"));
  auto file = start(
      {scene("shape = \"sphere\"", "file = \"missing.obj\""), "--output", path("b.png").string()});
  EXPECT_EQ(file.wait(), 2);
  EXPECT_THAT(file.output(), AllOf(HasSubstr("object \"ball\""), HasSubstr("missing.obj")));
  auto maps = start({scene(), "--output", path("b.png").string(), "--turn", "30"});
  EXPECT_EQ(maps.wait(), 2);
  EXPECT_THAT(maps.output(), HasSubstr("of a session's maps; this is a scene"));
  auto session = start({directory_.path().string(), "--output", path("b.png").string()});
  EXPECT_EQ(session.wait(), 2);
  EXPECT_THAT(session.output(), HasSubstr("session"));
  EXPECT_FALSE(fs::exists(path("b.png")));
}

TEST_F(RenderProgram, StopsSoonWhenInterruptedAndLeavesNoHalfPicture) {
  auto run =
      start({scene("tetrahedra = 3000", "tetrahedra = 2e6"), "--output", path("c.png").string()});
  ASSERT_TRUE(
      testing::eventually([&] { return run.output().find("preparing") != std::string::npos; }));
  run.kill(SIGINT);
  EXPECT_EQ(run.wait(), 3) << run.output();
  EXPECT_FALSE(fs::exists(path("c.png")));
}

TEST(Turntable, AFullTurnsPicturesAreNumberedAndTheCameraGoesTheOtherWay) {
  EXPECT_EQ(numbered("/a/b.png", 7, 120), "/a/b_007.png");
  EXPECT_EQ(numbered("/a/b.png", 0, 1), "/a/b.png");
  render::Scene scene;
  scene.camera.position = {10.0, 0.0, 5.0};
  scene.camera.target = {0.0, 0.0, 5.0};
  scene.lights.resize(1);
  scene.lights[0].position = {0.0, 3.0, 5.0};
  const TurnedView quarter = turned(scene, 90.0);
  EXPECT_NEAR(quarter.camera.position.y, -10.0, 1e-12);
  EXPECT_NEAR(quarter.lights[0].position.x, 3.0, 1e-12);
}

}  // namespace
}  // namespace opaline::daemon
