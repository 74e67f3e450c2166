// The real programs on an object in a small simulated sphere of lights.

#include <gmock/gmock.h>

#include <csignal>
#include <nlohmann/json.hpp>
#include <string>

#include "base/files.h"
#include "base/session_directory.h"
#include "config/session_config.h"
#include "sim/rig_client.h"
#include "tests/support/named_directory.h"
#include "tests/support/process.h"
#include "tests/support/temporary_directory.h"

namespace opaline::faults {
namespace {

using testing::eventually;
using testing::Process;

constexpr const char* kRig = R"(
[station]
name = "{name}"
[camera]
driver = "sim"
[light_stage]
driver = "sim"
lamps = 60
radius = "500 mm"
[sim]
run = "process"
socket = "{socket}"
time_factor = {factor}
[sim.sphere]
radii = ["8 mm"]
paths = 60000
[sim.camera]
width = 100
height = 100
fx = 5000
fy = 5000
cx = 50
cy = 50
distortion = [0.0, 0.0, 0.0, 0.0, 0.0]
rotation = [1.0, 0.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0, -1.0]
translation = ["0 mm", "0 mm", "1000 mm"]
full_well_electrons = 30000
gain_electrons_per_code = 7.5
)";
constexpr const char* kSession = R"(
name = "ball"
rig = "rig.toml"
kind = "led_sphere"
[sample]
name = "ball"
)";

class SphereSession : public ::testing::Test {
 protected:
  void TearDown() override {
    if (auto ended = sim::RigClient(socket_).end(); !ended) SUCCEED() << "there is none";
  }
  void make_session(int time_factor) {
    std::string rig = kRig;
    const auto put = [&](const std::string& key, const std::string& value) {
      rig.replace(rig.find(key), key.size(), value);
    };
    put("{name}", directory_.path().filename().string());
    put("{socket}", socket_.string());
    put("{factor}", std::to_string(time_factor));
    ASSERT_TRUE(write_whole(system_files(), directory_.path() / "rig.toml", rig));
    ASSERT_TRUE(write_whole(system_files(), directory_.path() / "session.toml", kSession));
    const auto contents = config::read_contents(directory_.path() / "session.toml");
    ASSERT_TRUE(contents) << contents.error().message;
    ASSERT_TRUE(SessionDirectory::create(system_files(), session_, *contents));
  }
  std::unique_ptr<Process> start(const std::string& program) const {
    const std::filesystem::path programs = opaline::testing::named_directory("OPALINE_BIN_DIR");
    return std::make_unique<Process>(
        std::vector<std::string>{(programs / program).string(), session_.string()},
        Process::Environment{},
        directory_.path() / (program + ".out"));
  }
  bool is_lit() const {
    const auto status = sim::RigClient(socket_).status();
    return status && status->lamp_on;
  }

  testing::TemporaryDirectory directory_;
  std::filesystem::path session_ = directory_.path() / "session";
  std::filesystem::path socket_ = directory_.path() / "rig.sock";
};

// The bounds: 10 % of D is what a short capture of a small ball states of itself (two deviations); docs/physics.md has what a whole one reaches.
TEST_F(SphereSession, GoesFromAConfigurationToMapsThatHoldAgainstTheTruth) {
  make_session(1000);
  for (const char* program : {"opaline-capture", "opaline-reconstruct", "opaline-preview"}) {
    const auto job = start(program);
    ASSERT_EQ(job->wait(), 0) << program << ": " << job->output();
  }
  const auto results = nlohmann::json::parse(*read_text(session_ / "results.json"));
  EXPECT_LT(results.at("truth").at("normal_error_deg").get<double>(), 1.0);
  for (const auto& ball : results.at("truth").at("balls")) {
    EXPECT_NEAR(
        ball.at("median_diffusion_mm").get<double>() / ball.at("diffusion_mm").get<double>(),
        1.0,
        0.1);
    EXPECT_NEAR(ball.at("median_reduced_albedo").get<double>(),
                ball.at("reduced_albedo").get<double>(),
                0.01);
    EXPECT_GT(ball.at("within_two_sigma").get<double>(), 0.9);
    EXPECT_GT(ball.at("found").get<int>(), 1000);
  }
  EXPECT_EQ(results.at("lamps"), 60);
  for (const auto& scale : results.at("pictures"))
    EXPECT_LT(scale.at("lowest").get<double>(), scale.at("highest").get<double>());
  for (const char* file : {"maps.exr",
                           "report.html",
                           "preview/normals.png",
                           "preview/specular.png",
                           "preview/diffusion.png",
                           "preview/translucency.png",
                           "preview/reduced_albedo.png"})
    EXPECT_TRUE(std::filesystem::exists(session_ / file)) << file;
}

TEST_F(SphereSession, ItsLampsGoDarkWithinASecondWhenTheCaptureIsKilled) {
  make_session(1);
  const auto capture = start("opaline-capture");
  ASSERT_TRUE(eventually([&] { return is_lit(); }, std::chrono::seconds(40))) << capture->output();
  const auto start = std::chrono::steady_clock::now();
  capture->kill(SIGKILL);
  EXPECT_TRUE(eventually([&] { return !is_lit(); }));
  // A second, and one more for a busy machine.
  EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(2));
}

}  // namespace
}  // namespace opaline::faults
