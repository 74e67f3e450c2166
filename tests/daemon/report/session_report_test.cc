#include "daemon/report/session_report.h"

#include <gmock/gmock.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "base/io/transport_io.h"
#include "daemon/report/surface_radiance.h"
#include "reconstruct/host/host_solver.h"
#include "render/translucency.h"
#include "sim/optics.h"
#include "sim/scene.h"
#include "tests/support/fabricated_session.h"
#include "tests/support/temporary_directory.h"

namespace opaline::daemon {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

class SessionReportTest : public ::testing::Test {
 protected:
  SessionReportTest() {
    sim::SceneOptions scene;
    scene.block = {12, 12, 6, 2.0, 2.0, 1.0};
    what_.truth = sim::make_material(scene).value();
    what_.found = what_.truth;
    what_.camera = sim::demo_camera_model();
    what_.camera.width = what_.camera.height = 64;
    for (double* value : {&what_.camera.fx, &what_.camera.fy, &what_.camera.cx, &what_.camera.cy}) {
      *value /= 4.0;
    }
  }

  /// Makes the session, runs the report, and answers results.json.
  nlohmann::json report() {
    const auto session = testing::fabricate_session(directory_.path() / "session", what_);
    EXPECT_TRUE(session) << session.error().message;
    NullSink events;
    JobContext job{*session, events, system_files(), {}};
    const auto done = report_session(job);
    EXPECT_TRUE(done) << done.error().message;
    page_ = read_text(session->report()).value();
    return nlohmann::json::parse(read_text(session->results()).value());
  }

  testing::TemporaryDirectory directory_;
  testing::Fabrication what_;
  std::string page_;
};

TEST_F(SessionReportTest, FindsNoMoreErrorThanNoiseInAPerfectMaterial) {
  const auto results = report();
  // 1 % of noise on every pixel; the error of that estimate is 1 % / sqrt(2 x some 3000 samples).
  EXPECT_NEAR(results["relighting_error"].get<double>(), 0.01, 0.0005);
  EXPECT_NEAR(results["relighting_noise_floor"].get<double>(), 0.01, 0.0005);
  EXPECT_EQ(results["relighting"]["lights"].size(), 3);
  EXPECT_TRUE(results["bssrdf_error"].is_null());
  EXPECT_GE(results["seconds"].get<double>(), 0.0);
}

TEST_F(SessionReportTest, MeasuresAMaterialThatIsTooDark) {
  what_.noise = 0.0;
  for (auto& channel : what_.found.channels) {
    for (double& absorption : channel.absorption) absorption += 0.01;
  }
  const auto results = report();
  const double error = results["relighting_error"].get<double>();
  EXPECT_GT(error, 0.05);
  EXPECT_LT(error, 0.9);
  EXPECT_LT(results["relighting_noise_floor"].get<double>(), 1e-6);
  for (const char* channel : {"red", "green", "blue"}) {
    EXPECT_GT(results["relighting"]["per_channel"][channel].get<double>(), 0.05);
  }
}

// Stored transport that is the diffusion answer itself, 10 % brighter: E = (0.1 / 1.1)^2.
TEST_F(SessionReportTest, ComparesWithStoredTransportPatchByPatch) {
  TransportResponses responses;
  responses.block = what_.truth.block;
  responses.patches_x = responses.patches_y = 2;
  responses.camera_centre = what_.camera.centre();
  responses.scene = sim::to_json(sim::SceneOptions{.block = responses.block});
  const auto cosines = view_cosines(responses.block, Face::kZMax, responses.camera_centre);
  const auto solver = reconstruct::host::make_host_solver({});
  for (int patch = 0; patch < 4; ++patch) {
    render::Light light{Face::kZMin, Image<float>(12, 12, 3)};
    for (int y = 0; y < 6; ++y) {
      for (int x = 0; x < 6; ++x) {
        for (int c = 0; c < 3; ++c)
          light.irradiance.at(6 * (patch % 2) + x, 6 * (patch / 2) + y, c) = 1.0F;
      }
    }
    const auto fields = render::illuminate(what_.truth, std::span(&light, 1), {}, *solver, {});
    ASSERT_TRUE(fields) << fields.error().message;
    auto radiance = surface_radiance(fields->front(), Face::kZMax, cosines);
    for (float& value : radiance.samples()) value *= 1.1F;
    responses.patches.push_back({radiance, Image<float>(12, 12, 3)});
  }
  what_.responses = directory_.path() / "stored.transport";
  ASSERT_TRUE(write_transport(system_files(), what_.responses, responses));

  EXPECT_NEAR(report()["bssrdf_error"].get<double>(), std::pow(0.1 / 1.1, 2), 1e-5);
}

TEST_F(SessionReportTest, PutsEverythingIntoOnePage) {
  report();
  EXPECT_THAT(page_, HasSubstr("<!doctype html>"));
  EXPECT_THAT(page_, HasSubstr("data:image/png;base64,"));
  EXPECT_THAT(page_, HasSubstr("<svg"));
  EXPECT_THAT(page_, HasSubstr("held_out_shifted"));
  EXPECT_THAT(page_, Not(HasSubstr("<script")));
  EXPECT_THAT(page_, Not(HasSubstr("src=\"http")));
  EXPECT_THAT(page_, Not(HasSubstr("href=\"http")));
}

}  // namespace
}  // namespace opaline::daemon
