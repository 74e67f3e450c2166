#include "config/session_config.h"

#include <gmock/gmock.h>

#include "tests/support/named_directory.h"
#include "tests/support/temporary_directory.h"

namespace opaline::config {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;
using ::testing::StartsWith;

fs::path config_file(const char* name) {
  return opaline::testing::named_directory("OPALINE_SOURCE_DIR") / "config" / name;
}

class SessionConfigTest : public ::testing::Test {
 protected:
  fs::path write(const char* name, std::string_view text) {
    const fs::path path = directory_.path() / name;
    EXPECT_TRUE(write_whole(system_files(), path, text));
    return path;
  }
  /// Line, column and message of every problem, without the file.
  static std::vector<std::string> problems_of(const fs::path& path) {
    const auto problems = check(path);
    EXPECT_TRUE(problems) << problems.error().message;
    std::vector<std::string> lines;
    for (const Problem& p : *problems) {
      lines.push_back(std::to_string(p.line) + ":" + std::to_string(p.column) + ": " + p.message);
    }
    return lines;
  }
  testing::TemporaryDirectory directory_;
};

TEST_F(SessionConfigTest, AcceptsEveryFileThatComesWithTheProgram) {
  for (const char* name : {"sim.toml",
                           "sim-rig.toml",
                           "sim-rig-chart.toml",
                           "sim_front_lit.toml",
                           "sim-rig-front-lit.toml",
                           "led_sphere.toml",
                           "sim-rig-sphere.toml",
                           "sim-boards.toml",
                           "sim_holder.toml",
                           "sim-rig-beside.toml",
                           "sim-rig-beside-believed.toml",
                           "sim-rig-beside-boards.toml",
                           "sim_beside.toml",
                           "sim_beside_believed.toml",
                           "sim-rig-holder.toml",
                           "sim-rig-holder-boards.toml",
                           "sim_holder_believed.toml",
                           "sim-rig-holder-believed.toml",
                           "led_blob.toml",
                           "sim-rig-blob.toml",
                           "session.example.toml",
                           "rig.example.toml"}) {
    const auto problems = check(config_file(name));
    ASSERT_TRUE(problems) << problems.error().message;
    EXPECT_THAT(*problems, IsEmpty()) << to_string(*problems);
  }
}

TEST_F(SessionConfigTest, ShowsEveryKeyInTheExamplesAsTheProgramExplainsIt) {
  EXPECT_EQ(read_text(config_file("session.example.toml")).value(), session_example());
  EXPECT_EQ(read_text(config_file("rig.example.toml")).value(), rig_example());
}

TEST_F(SessionConfigTest, ReadsThePrecisionAndRefusesOneThatTheDeviceDoesNotHave) {
  write("rig.toml", "");
  const auto session = load_session(
      write("host.toml",
            "rig = \"rig.toml\"\n[reconstruction]\nprecision = \"half\"\nback_end = \"host\"\n"));
  ASSERT_TRUE(session) << session.error().message;
  EXPECT_EQ(session->reconstruction.precision, reconstruct::diffusion::Precision::kHalf);
  const auto problems = problems_of(write(
      "device.toml",
      "rig = \"rig.toml\"\n[reconstruction]\nback_end = \"vulkan\"\nprecision = \"double\"\n"));
  ASSERT_THAT(problems, SizeIs(1));
  EXPECT_THAT(problems[0], AllOf(StartsWith("4:"), HasSubstr("expected \"single\"")));
}

TEST_F(SessionConfigTest, ReadsWhetherTheUncertaintyIsWanted) {
  write("rig.toml", "");
  const auto session = load_session(
      write("session.toml", "rig = \"rig.toml\"\n[reconstruction]\nuncertainty = true\n"));
  ASSERT_TRUE(session) << session.error().message;
  EXPECT_TRUE(session->uncertainty);
  const auto again = parse_resolved({"resolved.toml", to_toml(*session), {}});
  ASSERT_TRUE(again) << again.error().message;
  EXPECT_TRUE(again->uncertainty);
}

TEST_F(SessionConfigTest, TakesTheDefaultsWhereAFileSaysNothing) {
  write("rig.toml", "");
  const auto session = load_session(write("session.toml", "rig = \"rig.toml\"\n"));
  ASSERT_TRUE(session) << session.error().message;
  EXPECT_EQ(session->capture.patterns.regions, capture::CaptureOptions{}.patterns.regions);
  EXPECT_EQ(session->sample.block, capture::SampleGeometry{}.block);
  EXPECT_EQ(session->rig.sim.rig.camera.model, sim::demo_camera_model());
}

TEST_F(SessionConfigTest, TakesFromTheQualityWhatIsNotWritten) {
  write("rig.toml", "");
  const auto load = [&](const char* more) {
    auto session = load_session(write("session.toml", std::string("rig = \"rig.toml\"\n") + more));
    EXPECT_TRUE(session) << session.error().message;
    return *session;
  };
  const SessionConfig plain = load("");
  const SessionConfig standard = load("quality = \"standard\"\n");
  EXPECT_EQ(to_toml(standard), to_toml(plain));
  const SessionConfig draft = load("quality = \"draft\"\n");
  const SessionConfig reference = load("quality = \"reference\"\n");
  EXPECT_GT(draft.reduction.grid_step, standard.reduction.grid_step);
  EXPECT_LT(draft.capture.patterns.regions, standard.capture.patterns.regions);
  EXPECT_GT(reference.capture.patterns.regions, standard.capture.patterns.regions);
  EXPECT_LT(reference.reconstruction.tolerance, standard.reconstruction.tolerance);
  EXPECT_LT(draft.capture.exposures.planned_snr, standard.capture.exposures.planned_snr);
  EXPECT_GT(reference.capture.exposures.planned_snr, standard.capture.exposures.planned_snr);
  const SessionConfig mixed =
      load("quality = \"draft\"\n[capture]\nregions = 6\n[reconstruction]\ngrid_step = 1\n");
  EXPECT_EQ(mixed.capture.patterns.regions, 6);
  EXPECT_EQ(mixed.reduction.grid_step, 1.0);
  EXPECT_EQ(mixed.reconstruction.max_iterations, draft.reconstruction.max_iterations);
}

TEST_F(SessionConfigTest, ASphereOfLightsHasNoSurfaceCellsToPlanExposuresFor) {
  write("rig.toml", "");
  EXPECT_THAT(problems_of(write("session.toml",
                                "rig = \"rig.toml\"\nkind = \"led_sphere\"\n"
                                "[capture.exposures]\nmode = \"planned\"\n")),
              Contains(AllOf(HasSubstr("exposures are planned for surface cells"),
                             HasSubstr("expected capture.exposures.mode = \"bracket\""))));
}

TEST_F(SessionConfigTest, WritesWhatAQualityStandsForIntoTheResolvedFile) {
  write("rig.toml", "");
  const auto session = load_session(write("session.toml",
                                          "rig = \"rig.toml\"\nquality = \"draft\"\ntarget_error = "
                                          "\"2.5 %\"\n[capture]\nregions = 3\n"));
  ASSERT_TRUE(session) << session.error().message;
  EXPECT_DOUBLE_EQ(session->target_error, 0.025);
  const auto again = parse_resolved({"resolved.toml", to_toml(*session), {}});
  ASSERT_TRUE(again) << again.error().message;
  EXPECT_EQ(again->quality, Quality::kDraft);
  EXPECT_EQ(again->capture.patterns.regions, 3);
  EXPECT_EQ(again->reduction, session->reduction);
  EXPECT_EQ(to_toml(*again), to_toml(*session));
  EXPECT_THAT(to_toml(*session), HasSubstr("target_error = \"2.5 %\""));
}

TEST_F(SessionConfigTest, WantsHeldOutLightsForATargetError) {
  write("rig.toml", "");
  EXPECT_THAT(problems_of(write("session.toml",
                                "rig = \"rig.toml\"\ntarget_error = \"2 %\"\n[capture]\n"
                                "held_out_lights = 0\n")),
              ElementsAre(AllOf(StartsWith("2:"), HasSubstr("held_out_lights"))));
  EXPECT_THAT(problems_of(write("session.toml", "rig = \"rig.toml\"\ntarget_error = 0.02\n")),
              ElementsAre(HasSubstr("such as \"2 %\"")));
}

TEST_F(SessionConfigTest, ReadsItsOwnResolvedFileBackToTheSameConfiguration) {
  const auto session = load_session(config_file("sim.toml"));
  ASSERT_TRUE(session) << session.error().message;
  const std::string resolved = to_toml(*session);
  const auto again = parse_resolved({"resolved.toml", resolved, {}});
  ASSERT_TRUE(again) << again.error().message;
  EXPECT_EQ(to_toml(*again), resolved);
  EXPECT_EQ(again->rig.sim.scene, session->rig.sim.scene);
  EXPECT_EQ(again->rig.sim.transport, session->rig.sim.transport);
  EXPECT_EQ(again->rig.calibration.camera.model, session->rig.calibration.camera.model);
  EXPECT_EQ(again->capture.exposures.shortest, session->capture.exposures.shortest);
  EXPECT_TRUE(again->rig_file.is_absolute());
}

TEST_F(SessionConfigTest, FindsTenMistakesInOneGoEachAtItsPlace) {
  write("rig.toml", "[camera]\ndriver = \"webcam\"\n\n[sim.camera]\nwidth = \"256\"\n");
  const fs::path path = write("session.toml",
                              "name = 12\n"
                              "rig = \"rig.toml\"\n"
                              "retries = 3\n"
                              "\n"
                              "[sample]\n"
                              "size = [\"24 mm\", \"24 mm\", \"0 mm\"]\n"
                              "cells = [48, 48]\n"
                              "lit_face = \"top\"\n"
                              "[capture]\n"
                              "region = 4\n"
                              "[capture.exposures]\n"
                              "  longest = \"8 mm\"\n"
                              "ratio = 0.8\n"
                              "[reconstuction]\n");
  EXPECT_THAT(
      problems_of(path),
      ElementsAre("1:8: name is 12; expected a text in quotes",
                  "3:1: unknown key \"retries\"; it belongs in [capture]",
                  "6:27: size is \"0 mm\"; expected a length with its unit, such as \"24 mm\", "
                  "more than 0 mm",
                  "7:9: cells is a list of 2; expected a list of 3, each a whole number, 1 to 1024",
                  StartsWith("8:12: lit_face is \"top\"; expected one of \"x_min\""),
                  "10:1: unknown key \"region\" in [capture]; did you mean \"regions\"?",
                  "12:13: longest is \"8 mm\"; expected a time with its unit, such as \"33 ms\" or "
                  "\"1/30 s\", "
                  "1 ns to 100000 s",
                  "13:9: ratio is 0.8; expected a number, more than 1, at most 16",
                  "14:2: unknown key \"reconstuction\"; did you mean \"reconstruction\"?",
                  "2:10: driver is \"webcam\"; expected one of \"sim\", \"replay\"",
                  "5:9: width is \"256\"; expected a whole number, 1 to 8192"));
  const auto session = load_session(path);
  ASSERT_FALSE(session);
  EXPECT_EQ(session.error().code, ErrorCode::kInvalidArgument);
  EXPECT_THAT(session.error().message, HasSubstr("rig.toml:5:9: width"));
}

TEST_F(SessionConfigTest, FindsTheImpossibleValuesOfARig) {
  EXPECT_THAT(problems_of(write("rig.toml",
                                "[projector]\n"
                                "driver = \"replay\"\n"
                                "[replay]\n"
                                "folder = \"\"\n"
                                "[sim.camera]\n"
                                "longest_exposure = \"0.1 ns\"\n"
                                "[sim.projector]\n"
                                "black_level = 1\n"
                                "[calibration.camera]\n"
                                "hot_pixels = [0, 0, 255, 256]\n"
                                "vignetting = [-4, 3.5, 0]\n"  // dark at r^2 = 4/7 only
                                "[calibration.projector]\n"
                                "black_level = 1.0\n"
                                "vignetting = [-1, 0, 0]\n")),
              ElementsAre(StartsWith("4:10: folder: expected the folder"),
                          HasSubstr("6:20: longest_exposure is \"0.1 ns\""),
                          AllOf(StartsWith("8:15: black_level is 1;"), HasSubstr("less than 1")),
                          AllOf(StartsWith("10:14: hot_pixels: "), HasSubstr("no pixel 255, 256")),
                          AllOf(StartsWith("11:14: vignetting: "), HasSubstr("all over")),
                          StartsWith("13:15: black_level is 1"),
                          StartsWith("14:14: vignetting: ")));
}

TEST_F(SessionConfigTest, FindsTheImpossibleValuesOfASession) {
  write("rig.toml", "");
  EXPECT_THAT(problems_of(write("session.toml",
                                "rig = \"rig.toml\"\n"
                                "[capture]\n"
                                "direct_light_margin = \"2 m\"\n"
                                "[capture.exposures]\n"
                                "shortest = \"0.1 ns\"\n"
                                "longest = \"1e11 s\"\n")),
              ElementsAre(HasSubstr("direct_light_margin is \"2 m\""),
                          AllOf(HasSubstr("shortest is \"0.1 ns\""), HasSubstr("1 ns to")),
                          AllOf(HasSubstr("longest is \"1e11 s\""), HasSubstr("100000 s"))));
}

TEST_F(SessionConfigTest, NamesTheKeyThatNamesAMissingRigFileAndFindsTheOtherProblemsToo) {
  const fs::path path = write("session.toml", "colour = 1\nrig = \"nowhere.toml\"\n");
  EXPECT_THAT(problems_of(path),
              ElementsAre(StartsWith("1:1: unknown key \"colour\""),
                          AllOf(StartsWith("2:7: rig: "), HasSubstr("nowhere.toml"))));
}

TEST_F(SessionConfigTest, SaysThatTheRigIsMissing) {
  EXPECT_THAT(problems_of(write("session.toml", "name = \"x\"\n")),
              ElementsAre("1:1: missing key \"rig\": the rig file"));
}

TEST_F(SessionConfigTest, PointsAtASyntaxError) {
  EXPECT_THAT(problems_of(write("session.toml", "name = \"x\"\n[capture\n")),
              ElementsAre(StartsWith("2:9: ")));
}

TEST_F(SessionConfigTest, NamesAMissingSessionFile) {
  const auto session = load_session(directory_.path() / "nowhere.toml");
  ASSERT_FALSE(session);
  EXPECT_EQ(session.error().code, ErrorCode::kNotFound);
  EXPECT_THAT(session.error().message, HasSubstr("nowhere.toml"));
}

TEST_F(SessionConfigTest, HoldsASimulatedSampleToTheOneThatIsSimulated) {
  write("rig.toml", "");
  EXPECT_THAT(
      problems_of(write("session.toml",
                        "rig = \"rig.toml\"\n[sample]\nsize = [\"24 mm\", \"24 mm\", \"8 mm\"]\n")),
      ElementsAre("3:8: size: the simulated sample measures 24 x 24 x 6 mm"));
}

TEST_F(SessionConfigTest, FindsWhatTheRigCannotDoInOneGo) {
  write("rig.toml",
        "[sim.projector]\n"
        "mm_per_pixel = 1.0\n"  // 24 pixels across the face
        "offset_x_px = 20\n"
        "[calibration.camera]\n"
        "width = 320\n"
        "height = 256\n");
  const fs::path path = write("session.toml",
                              "rig = \"rig.toml\"\n"
                              "[capture]\n"
                              "regions = 30\n"
                              "[capture.exposures]\n"
                              "longest = \"30 ms\"\n"
                              "shortest = \"20 ms\"\n");
  EXPECT_THAT(problems_of(path),
              ElementsAre(AllOf(StartsWith("3:11: regions: "), HasSubstr("smaller than")),
                          AllOf(StartsWith("5:11: longest: "), HasSubstr("colour wheel")),
                          AllOf(StartsWith("5:9: width: "),
                                HasSubstr("320 x 256 pixels of 12 bits"),
                                HasSubstr("256 x 256"))));
}

TEST_F(SessionConfigTest, FindsAFaceThatTheDevicesDoNotReach) {
  write("rig.toml",
        "station.nmae = \"x\"\n"  // some other problem
        "[sim.projector]\n"
        "offset_x_px = 600\n"
        "[sim.camera]\n"
        "cx = 99999.0\n");
  EXPECT_THAT(problems_of(write("session.toml",
                                "rig = \"rig.toml\"\n"
                                "[capture.exposures]\n"
                                "ratio = 1.001\n"
                                "[sample]\n"
                                "seen_face = \"z_max\"\n"
                                "size = [\"24 mm\", \"24 mm\", \"6 mm\"]\n")),
              ElementsAre(AllOf(StartsWith("3:9: ratio: "), HasSubstr("64 exposures")),
                          AllOf(StartsWith("5:13: seen_face: "), HasSubstr("sees nothing")),
                          AllOf(StartsWith("6:8: size: "), HasSubstr("within its picture")),
                          HasSubstr("unknown key \"nmae\"")));
}

TEST_F(SessionConfigTest, JudgesNothingByWhatTheRigSaysWrong) {
  write("rig.toml",
        "[sim.scene]\nsize = [\"30 mm\", \"30 mm\", 6]\n"
        "[sim.projector]\nmm_per_pixel = -1\n[sim.camera]\ncy = \"9999\"\n");
  EXPECT_THAT(problems_of(write("session.toml",
                                "rig = \"rig.toml\"\n"
                                "[sample]\nsize = [\"30 mm\", \"30 mm\", \"6 mm\"]\n"
                                "lit_face = \"x_min\"\n")),
              ElementsAre(StartsWith("4:12: lit_face: the simulated light enters by"),
                          StartsWith("2:27: size is 6"),
                          StartsWith("4:16: mm_per_pixel is -1"),
                          StartsWith("6:6: cy is")));
}

TEST_F(SessionConfigTest, TakesASessionWithAStrayTableForASession) {
  write("rig.toml", "");
  EXPECT_THAT(
      problems_of(write("session.toml", "rig = \"rig.toml\"\n[camera]\ndriver = \"sim\"\n")),
      ElementsAre(AllOf(StartsWith("2:2: unknown key \"camera\""))));
}

TEST_F(SessionConfigTest, MakesPathsAbsoluteAndRefusesRelativeOnesInTexts) {
  fs::create_directory(directory_.path() / "photographs");
  const std::string rig =
      "camera.driver = \"replay\"\nreplay.folder = \"photographs\"\n"
      "[calibration.camera]\nwidth = 64\nheight = 64\nfx = 600\nfy = 600\ncx = 32\ncy = 32\n";
  const auto loaded = load_rig(write("rig.toml", rig));
  ASSERT_TRUE(loaded) << loaded.error().message;
  EXPECT_EQ(loaded->replay_folder, directory_.path() / "photographs");

  const auto session =
      parse_session({"session.toml", "rig = \"rig.toml\"", {}}, {"rig.toml", rig, {}});
  ASSERT_FALSE(session);
  EXPECT_THAT(session.error().message,
              HasSubstr("rig.toml:2:17: folder is \"photographs\"; "
                        "expected an absolute path"));
}

TEST_F(SessionConfigTest, AsksForTheCalibrationOfACameraThatCannotKnowItself) {
  EXPECT_THAT(
      problems_of(write("rig.toml", "[camera]\ndriver = \"replay\"\n[replay]\nfolder = \"/\"\n")),
      SizeIs(6));  // width, height, fx, fy, cx, cy
}

TEST_F(SessionConfigTest, MakesASessionDirectoryOfTheFilesAsGivenAndAsResolved) {
  write("rig.toml", "# mine\n");
  const auto contents = read_contents(write("session.toml", "rig = \"rig.toml\"\nname = \"a\"\n"));
  ASSERT_TRUE(contents) << contents.error().message;
  EXPECT_EQ(contents->name, "a");
  EXPECT_EQ(contents->rig_toml, "# mine\n");
  const auto directory =
      SessionDirectory::create(system_files(), directory_.path() / "sessions" / "a", *contents);
  ASSERT_TRUE(directory) << directory.error().message;
  EXPECT_EQ(load_resolved(*directory).value().name, "a");
}

}  // namespace
}  // namespace opaline::config
