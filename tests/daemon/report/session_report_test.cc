#include "daemon/report/session_report.h"

#include <fmt/format.h>
#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <map>
#include <nlohmann/json.hpp>
#include <set>

#include "base/face_view.h"
#include "base/io/image_io.h"
#include "base/io/transport_io.h"
#include "base/thread_team.h"
#include "calibration/record.h"
#include "config/scene_config.h"
#include "daemon/render/scene_view.h"
#include "daemon/report/html.h"
#include "daemon/report/step_progress.h"
#include "daemon/report/surface_radiance.h"
#include "reconstruct/host/host_solver.h"
#include "render/translucency.h"
#include "sim/optics.h"
#include "sim/scene.h"
#include "tests/support/fabricated_session.h"
#include "tests/support/temporary_directory.h"
#include "tests/support/vulkan.h"

namespace opaline::daemon {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

/// Keeps what a report says about how far it is.
class ProgressSink : public NullSink {
 public:
  void progress(const Progress& progress) override { steps[progress.step].push_back(progress); }
  std::map<std::string, std::vector<Progress>> steps;
};

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
    what_.gpu = tests::validated();
  }

  std::filesystem::path session() const { return directory_.path() / "session"; }

  /// Makes the session, runs the report, and answers results.json.
  nlohmann::json report() {
    const auto session = testing::fabricate_session(this->session(), what_);
    EXPECT_TRUE(session) << session.error().message;
    if (record_) {
      EXPECT_TRUE(system_files().make_directories(session->calibration().parent_path()));
      EXPECT_TRUE(write_whole(system_files(), session->calibration(), to_text(*record_)));
    }
    JobContext job{*session, progress_, system_files(), {}};
    const auto done = report_session(job, tests::validated());
    EXPECT_TRUE(done) << done.error().message;
    page_ = read_text(session->report()).value();
    return nlohmann::json::parse(read_text(session->results()).value());
  }

  std::string section(const std::string& id) const {
    const std::size_t begin = page_.find("<section id=\"" + id + "\">");
    EXPECT_NE(begin, std::string::npos) << id;
    return begin == std::string::npos
               ? ""
               : page_.substr(begin, page_.find("</section>", begin) - begin);
  }

  testing::TemporaryDirectory directory_;
  testing::Fabrication what_;
  std::optional<calibration::Record> record_;  ///< of the calibration that the session took over
  ProgressSink progress_;
  std::string page_;
};

std::string percent(const nlohmann::json& share) {
  return fmt::format("{:.2f} %", 100.0 * share.get<double>());
}

std::size_t count(std::string_view text, std::string_view what) {
  std::size_t found = 0;
  for (std::size_t at = text.find(what); at != text.npos; at = text.find(what, at + 1)) ++found;
  return found;
}

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
  const auto cosines = view_of_face(responses.block, Face::kZMax, responses.camera_centre).cosine;
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

  const auto results = report();
  EXPECT_NEAR(results["bssrdf_error"].get<double>(), std::pow(0.1 / 1.1, 2), 1e-5);
  EXPECT_THAT(page_,
              HasSubstr(fmt::format("<b>{:.4f}</b>", results["bssrdf_error"].get<double>())));
  EXPECT_EQ(progress_.steps["BSSRDF error"].size(), 3U);  // at the start, and after two rows
}

TEST_F(SessionReportTest, PutsEverythingIntoOnePage) {
  report();
  EXPECT_THAT(page_, HasSubstr("<!doctype html>"));
  EXPECT_THAT(page_, HasSubstr("data:image/png;base64,"));
  EXPECT_THAT(page_, Not(HasSubstr("<script")));
  EXPECT_THAT(page_, Not(HasSubstr("src=\"http")));
  EXPECT_THAT(page_, Not(HasSubstr("href=\"http")));
}

TEST_F(SessionReportTest, ShowsTheErrorOfEachLightAndOfAllTogether) {
  what_.noise = 0.02;
  const auto results = report();
  const std::string shown = section("relighting");
  ASSERT_EQ(results["relighting"]["lights"].size(), 3U);
  std::set<std::string> errors;
  for (const auto& light : results["relighting"]["lights"]) {
    EXPECT_THAT(shown,
                HasSubstr(fmt::format("<td>{}</td><td>{}</td><td>{}</td><td>{}</td>",
                                      light["name"].get<std::string>(),
                                      percent(light["error"]),
                                      percent(light["noise_floor"]),
                                      percent(light["per_channel"]["red"]))));
    errors.insert(percent(light["error"]));
  }
  EXPECT_GT(errors.size(), 1U);  // each has its own
  EXPECT_THAT(shown,
              HasSubstr(fmt::format("<td>all together</td><td>{}</td><td>{}</td>",
                                    percent(results["relighting_error"]),
                                    percent(results["relighting_noise_floor"]))));
  EXPECT_THAT(page_, HasSubstr("<b>" + percent(results["relighting_error"]) + "</b>"));
  EXPECT_THAT(
      shown,
      HasSubstr(fmt::format("white is {:.3g} W/", results["pictures"]["white"].get<double>())));
  EXPECT_GT(results["pictures"]["difference_scale"].get<double>(), 0.0);
  EXPECT_EQ(count(shown, "<img"), 9U);
  EXPECT_EQ(count(shown, "<svg"), 1U);
}

TEST_F(SessionReportTest, WritesThePicturesOfEachHeldOutLight) {
  const auto results = report();
  for (const auto& light : results["relighting"]["lights"]) {
    for (const char* ending :
         {"captured.png", "relit.png", "difference.png", "captured.exr", "relit.exr"}) {
      const auto path =
          session() / "preview" / fmt::format("{}-{}", light["name"].get<std::string>(), ending);
      const auto bytes = read_bytes(path, 1 << 24);
      ASSERT_TRUE(bytes) << bytes.error().message;
      EXPECT_TRUE(decode_image(*bytes)) << path;
    }
  }
}

TEST_F(SessionReportTest, ShowsEachCapturedPictureAndWhatIsSaturatedInIt) {
  what_.saturated_rows = 16;
  const auto results = report();
  const std::string shown = section("capture");
  ASSERT_EQ(results["capture"]["lights"].size(), 7U);
  for (const auto& light : results["capture"]["lights"]) {
    EXPECT_EQ(light["saturated_share"].get<double>(), 0.25);
    EXPECT_THAT(shown, HasSubstr(light["name"].get<std::string>() + ", 25.00 % saturated"));
  }
  EXPECT_EQ(count(shown, "<img"), 7U);
}

TEST_F(SessionReportTest, ShowsHowThePicturesAreExplained) {
  const auto results = report();
  const std::string fit = section("fit");
  EXPECT_EQ(count(fit, "<svg"), 3U);
  for (const auto& light : results["fit"]) {
    EXPECT_THAT(fit, HasSubstr(light["name"].get<std::string>()));
    EXPECT_TRUE(light["error"].is_number());
  }
  EXPECT_NEAR(results["fit_noise_floor"].get<double>(), 0.01, 0.0005);
  const std::string convergence = section("convergence");
  EXPECT_EQ(count(convergence, "<svg"), 1U);
  for (const auto& channel : results["reconstruction"]["channels"]) {
    EXPECT_THAT(convergence,
                HasSubstr(fmt::format("<td>{}</td><td>{}</td><td>{:.4g}</td>",
                                      channel["channel"].get<std::string>(),
                                      channel["history"].size() - 1,
                                      channel["chi_squared_per_datum"].get<double>())));
    EXPECT_THAT(convergence, HasSubstr(channel["stop_explanation"].get<std::string>()));
  }
}

TEST_F(SessionReportTest, ShowsWhichModelsWereTriedAndWhyItStopped) {
  const auto results = report();
  const std::string shown = section("model");
  EXPECT_EQ(count(shown, "<svg"), 1U);
  for (const auto& channel : results["reconstruction"]["channels"]) {
    const auto name = channel["channel"].get<std::string>();
    EXPECT_THAT(shown, HasSubstr(name + ": heterogeneous. Why no finer model: there is no finer"));
    for (const auto& rung : channel["ladder"]) {
      EXPECT_THAT(shown,
                  HasSubstr(fmt::format("<td>{}: {}</td><td>{}</td><td>{:.3g}</td><td>{:.3g} ± 1.5",
                                        name,
                                        rung["model"].get<std::string>(),
                                        rung["parameters"].get<int>(),
                                        rung["fitted_chi_squared_per_datum"].get<double>(),
                                        rung["held_out_chi_squared_per_datum"].get<double>())));
      EXPECT_THAT(shown, HasSubstr(rung["why"].get<std::string>()));
    }
  }
  EXPECT_THAT(shown, HasSubstr("1.25 (1.125 to 1.375)"));
  EXPECT_THAT(shown, HasSubstr("0.02 (0.015 to 0.025)"));
}

TEST_F(SessionReportTest, ShowsHowWellEachDepthIsKnown) {
  report();
  const std::string shown = section("uncertainty");
  EXPECT_EQ(count(shown, "<svg"), 2U);
  EXPECT_THAT(shown, HasSubstr("depth below the seen face, mm"));
  for (const char* channel : {"red", "green", "blue"}) {
    EXPECT_THAT(shown,
                HasSubstr(fmt::format(
                    "<td>{}: {}</td><td>1.50</td><td>0.03</td>", channel, html::escaped("σs'"))));
  }
}

TEST_F(SessionReportTest, CutsEachCoefficientOfEachChannel) {
  report();
  const std::string shown = section("material");
  EXPECT_EQ(count(shown, "<svg"), 9U);
  for (const char* label : {"absorption σa, 1/mm", "scattering σs', 1/mm", "diffusion κ, mm"}) {
    EXPECT_THAT(shown, HasSubstr(label));
  }
}

// Red and blue change places: a correction that nobody could overlook.
TEST_F(SessionReportTest, ShowsThePicturesInTheColoursThatTheChartTold) {
  const auto own = report();
  EXPECT_EQ(own["assumptions"]["Colours of the pictures"], "the camera's own, not corrected");
  const auto picture = [&] {
    const auto bytes = read_bytes(
        session() / "preview" /
            (own["relighting"]["lights"][0]["name"].get<std::string>() + "-captured.png"),
        1 << 24);
    return std::get<Image<std::uint8_t>>(decode_image(bytes.value()).value().pixels);
  };
  const auto before = picture();
  std::filesystem::remove_all(session());
  record_.emplace();
  record_->version = 7;
  record_->created = "2026-01-31T12:34:56Z";
  record_->measured.color = calibration::ColorCorrection{calibration::ColorModel::kMatrix,
                                                         {1.0, 1.0, 1.0},
                                                         {0.1430804,
                                                          0.3850649,
                                                          0.4360747,
                                                          0.0606169,
                                                          0.7168786,
                                                          0.2225045,
                                                          0.7141733,
                                                          0.0971045,
                                                          0.0139322}};
  const auto results = report();
  EXPECT_EQ(results["assumptions"]["Colours of the pictures"],
            "sRGB, by the 3 x 3 matrix of calibration 7 of 2026-01-31T12:34:56Z");
  EXPECT_EQ(results["relighting_error"], own["relighting_error"]);  // judged by the camera's own
  const auto after = picture();
  ASSERT_EQ(after.samples().size(), before.samples().size());
  int most = 0;
  int colored = 0;
  for (std::size_t i = 0; i < after.samples().size(); ++i) {
    const std::size_t other = i % 3 == 0 ? i + 2 : i % 3 == 2 ? i - 2 : i;
    most = std::max(most, std::abs(after.samples()[i] - before.samples()[other]));
    colored = std::max(colored, std::abs(after.samples()[i] - before.samples()[i]));
  }
  EXPECT_LE(most, 1);  // rounding of the matrices
  EXPECT_GT(colored, 10);
}

TEST_F(SessionReportTest, SaysWhatWasAssumedAndSetAndHowLongItTook) {
  const auto results = report();
  ASSERT_GT(results["assumptions"].size(), 5U);
  for (const auto& [what, value] : results["assumptions"].items()) {
    EXPECT_THAT(section("assumptions"), HasSubstr(html::escaped(value.get<std::string>()))) << what;
  }
  EXPECT_THAT(section("settings"),
              HasSubstr(html::escaped(results["settings_toml"].get<std::string>())));
  const std::string timings = section("timings");
  for (const auto& [stage, seconds] : results["seconds_per_stage"].items()) {
    EXPECT_THAT(timings,
                HasSubstr(fmt::format("<td>{}</td><td>{:.1f} s", stage, seconds.get<double>())));
  }
  EXPECT_THAT(timings, HasSubstr(results["versions"]["solver"].get<std::string>()));
  EXPECT_EQ(results["cells"], nlohmann::json({12, 12, 6}));
}

Image<float> read_picture(const std::filesystem::path& file) {
  const auto bytes = read_bytes(file, 1 << 26);
  EXPECT_TRUE(bytes) << file;
  const auto image = bytes ? decode_image(*bytes) : Result<ImageFile>(bytes.error());
  EXPECT_TRUE(image) << file;
  return image ? std::get<Image<float>>(image->pixels) : Image<float>(1, 1, 4);
}

/// ||a - b|| / ||b|| of what is seen.
double difference(const Image<float>& a, const Image<float>& b) {
  EXPECT_EQ(a.samples().size(), b.samples().size());
  double off = 0.0;
  double all = 0.0;
  for (std::size_t i = 0; i < std::min(a.samples().size(), b.samples().size()); ++i) {
    off += std::pow(a.samples()[i] - b.samples()[i], 2);
    all += std::pow(b.samples()[i], 2);
  }
  return std::sqrt(off / all);
}

TEST_F(SessionReportTest, DrawsAnObjectOfTheMaterial) {
  what_.object = "torus";
  const auto results = report();
  const nlohmann::json& ring = results["object"]["objects"][1];
  EXPECT_EQ(ring["kind"], "translucent");
  EXPECT_GT(ring["tetrahedra"].get<int>(), 1000);
  // A torus of 24 mm, the face's shorter side: 2 pi^2 R r^2 with R = 9 and r = 3 mm; cut into so few
  // tetrahedra it is 10 % smaller.
  EXPECT_NEAR(ring["volume_mm3"].get<double>(), 2 * std::pow(M_PI, 2) * 9 * 9, 160.0);
  EXPECT_LE(ring["relative_residual"].get<double>(), 1e-5);
  EXPECT_THAT(section("object"), HasSubstr("data:image/png;base64,"));
  EXPECT_THAT(section("object"),
              HasSubstr(fmt::format("<td>{}</td>", ring["tetrahedra"].get<int>())));
  EXPECT_EQ(progress_.steps["object"].back().fraction, 1.0);
  const auto shown = read_bytes(session() / "preview" / "object.png", 1 << 24);
  ASSERT_TRUE(shown);
  EXPECT_EQ(std::get<Image<std::uint8_t>>(decode_image(*shown)->pixels).width(), 640);
}

TEST_F(SessionReportTest, LightsAnObjectAsTheFoundCoefficientsSay) {
  what_.object = "torus";
  for (auto& channel : what_.found.channels) {
    std::ranges::fill(channel.absorption, 0.03);
    std::ranges::fill(channel.reduced_scattering, 1.5);
  }
  report();
  // The same scene with the coefficients written out, without the session's files.
  std::string text = read_text(session() / "preview" / "object.toml").value();
  const std::size_t file = text.find("file = ");
  text.replace(file,
               text.size() - file,
               fmt::format("absorption = [0.03, 0.03, 0.03]\nreduced_scattering = [1.5, 1.5, "
                           "1.5]\nior = {}\n",
                           what_.found.ior));
  const auto scene = config::parse_scene({"written.toml", text, {}});
  ASSERT_TRUE(scene) << scene.error().message;
  ThreadTeam team(2);
  const auto view = SceneView::create(*scene, DrawBy::kAuto, {}, team, [](auto, auto) {}, {});
  ASSERT_TRUE(view) << view.error().message;
  const auto written = (*view)->picture(scene->lights, scene->camera, {});
  ASSERT_TRUE(written) << written.error().message;
  const auto drawn = read_picture(session() / "preview" / "object.exr");
  EXPECT_LT(difference(drawn, *written), 1e-4);  // the solutions' tolerance is 1e-5
}

TEST_F(SessionReportTest, DrawsTheSceneOfAnObjectAsItWasEdited) {
  what_.object = "sphere";
  report();
  const auto before = read_picture(session() / "preview" / "object.exr");
  const auto file = session() / "preview" / "object.toml";
  const std::string edited = read_text(file).value() +
                             "[[objects.edits]]\noperation = \"scale\"\nvalue = [1, 30, 30]\n"
                             "reach = \"through\"\nradius = \"40 mm\"\n";
  ASSERT_TRUE(write_whole(system_files(), file, edited));
  const auto session = SessionDirectory::open(this->session());
  JobContext job{*session, progress_, system_files(), {}};
  ASSERT_TRUE(report_session(job, tests::validated()));
  EXPECT_EQ(read_text(file).value(), edited);
  const auto after = read_picture(this->session() / "preview" / "object.exr");
  double red = 0.0, green = 0.0, red_before = 0.0, green_before = 0.0;
  for (int y = 180; y < 300; ++y) {
    for (int x = 280; x < 360; ++x) {
      red += after.at(x, y, 0);
      green += after.at(x, y, 1);
      red_before += before.at(x, y, 0);
      green_before += before.at(x, y, 1);
    }
  }
  EXPECT_NEAR(red, red_before, 0.01 * red_before);  // a factor of one
  EXPECT_LT(green, 0.7 * green_before);             // absorbs thirty times as much
}

TEST_F(SessionReportTest, SaysWhyThereIsNoPictureOfAnObject) {
  what_.object = "torus";
  report();
  ASSERT_TRUE(write_whole(
      system_files(), session() / "preview" / "object.toml", std::string_view("nonsense = 1\n")));
  const auto session = SessionDirectory::open(this->session());
  JobContext job{*session, progress_, system_files(), {}};
  ASSERT_TRUE(report_session(job, tests::validated()));
  page_ = read_text(session->report()).value();
  EXPECT_THAT(section("object"), HasSubstr("Not drawn"));
  EXPECT_THAT(section("object"), HasSubstr("object.toml:1:1"));
}

TEST_F(SessionReportTest, DoesWithoutHeldOutLights) {
  what_.held_out = 0;
  const auto results = report();
  EXPECT_TRUE(results["relighting_error"].is_null());
  EXPECT_TRUE(results["pictures"]["white"].is_null());
  EXPECT_EQ(results["fit"].size(), 4U);
  EXPECT_THAT(section("relighting"), HasSubstr("no light was kept from the fit"));
  EXPECT_EQ(count(section("fit"), "<svg"), 2U);
  EXPECT_THAT(page_, Not(HasSubstr("class=\"trio\"")));
}

TEST_F(SessionReportTest, DoesWithHeldOutLightsThatCannotBeUsed) {
  what_.held_out_works = false;
  const auto results = report();
  EXPECT_TRUE(results["relighting_error"].is_null());
  EXPECT_EQ(results["relighting"]["lights"].size(), 0U);
  EXPECT_TRUE(results["fit"].back()["error"].is_null());
  EXPECT_THAT(section("relighting"), HasSubstr("none of those could be used"));
}

/// A path without programs, for the test's duration.
class NoPrograms {
 public:
  NoPrograms() : path_(std::getenv("PATH")) { ::setenv("PATH", "/nonexistent", 1); }
  ~NoPrograms() { ::setenv("PATH", path_.c_str(), 1); }

 private:
  std::string path_;
};

TEST_F(SessionReportTest, LeavesNotesWhereGnuplotIsMissing) {
  const NoPrograms none;
  const auto results = report();
  EXPECT_TRUE(results["relighting_error"].is_number());
  EXPECT_THAT(page_, HasSubstr("17 of 17 plots could not be drawn"));
  EXPECT_THAT(page_, HasSubstr("apt install gnuplot-nox"));
  EXPECT_THAT(section("convergence"), HasSubstr("Not drawn: Misfit"));
}

TEST(StepProgress, ExpectsTheRestToGoAsFastAsWhatIsDone) {
  ProgressSink heard;
  ManualClock clock;
  StepProgress progress(heard, clock, "lighting");
  clock.advance(std::chrono::seconds(6));
  progress.done(0.25);
  ASSERT_EQ(heard.steps["lighting"].size(), 2U);
  EXPECT_FALSE(heard.steps["lighting"][0].seconds_left);
  EXPECT_DOUBLE_EQ(heard.steps["lighting"][1].seconds_left.value(), 18.0);
}

TEST_F(SessionReportTest, TellsHowFarEachStepIs) {
  report();
  for (const auto& [step, times] :
       std::map<std::string, std::size_t>{{"lighting", 2}, {"relighting", 8}, {"report", 18}}) {
    const auto& heard = progress_.steps[step];
    ASSERT_EQ(heard.size(), times) << step;
    EXPECT_EQ(heard.front().fraction, 0.0);
    EXPECT_EQ(heard.back().fraction, 1.0);
    for (std::size_t i = 1; i < heard.size(); ++i) {
      EXPECT_GT(heard[i].fraction, heard[i - 1].fraction);
      EXPECT_TRUE(heard[i].seconds_left) << step;
    }
  }
}

}  // namespace
}  // namespace opaline::daemon
