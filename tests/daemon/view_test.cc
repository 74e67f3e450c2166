// `opaline view` in a window of its own display, on lavapipe under the validation layer.

#include <gmock/gmock.h>
#include <signal.h>

#include <fstream>

#include "base/files.h"
#include "base/io/image_io.h"
#include "base/io/volume_io.h"
#include "tests/support/named_directory.h"
#include "tests/support/process.h"
#include "tests/support/temporary_directory.h"

namespace opaline {
namespace {

using ::testing::HasSubstr;
using ::testing::MatchesRegex;

constexpr const char* kScene = R"(
[diffusion]
tetrahedra = 4000
[picture]
refinement = 0
[camera]
position = ["30 mm", "-36 mm", "34 mm"]
field_of_view = "26 deg"
[[lights]]
name = "sun"
direction = [-0.4, -0.8, -0.9]
irradiance = [1.0, 1.0, 1.0]
[[objects]]
name = "ring"
shape = "torus"
size = "20 mm"
[objects.material]
absorption = [0.01, 0.01, 0.01]
reduced_scattering = [1.0, 1.0, 1.0]
edit_cells = 40
)";

class Viewer : public ::testing::Test {
 protected:
  void SetUp() override {
    display_.emplace(
        std::vector<std::string>{
            "/usr/bin/Xvfb", "-displayfd", "1", "-screen", "0", "1024x800x24", "-nolisten", "tcp"},
        testing::Process::Environment{},
        directory_.path() / "display");
    ASSERT_TRUE(testing::eventually([&] { return number().find('\n') != std::string::npos; }))
        << "Xvfb: " << display_->output();
    std::ofstream(directory_.path() / "scene.toml") << kScene;
  }
  void TearDown() override { display_->kill(SIGTERM); }

  std::string number() const {
    const std::string text = display_->output();
    const auto digit = text.find_first_of("0123456789");
    return digit == std::string::npos ? "" : text.substr(digit);
  }
  std::string file(const char* name) const { return (directory_.path() / name).string(); }

  int view(std::vector<std::string> words, bool with_display = true) {
    std::vector<std::string> command{
        opaline::testing::named_directory("OPALINE_BIN_DIR").string() + "/opaline",
        "view",
        file("scene.toml"),
        "--validation"};
    command.insert(command.end(), words.begin(), words.end());
    const std::string shown = number();
    testing::Process viewer(
        command,
        {{"DISPLAY", with_display ? ":" + shown.substr(0, shown.find('\n')) : ""}},
        directory_.path() / "output");
    const int status = viewer.wait();
    said_ = viewer.output();
    return status;
  }
  Image<std::uint8_t> picture(const char* name) const {
    const auto text = read_text(directory_.path() / name);
    EXPECT_TRUE(text) << name;
    const auto image = decode_image(std::as_bytes(std::span(*text)));
    EXPECT_TRUE(image) << image.error().message;
    return std::get<Image<std::uint8_t>>(image->pixels);
  }
  /// Green less red, over a patch at the right of the ring, beside the panels.
  static int green_less_red(const Image<std::uint8_t>& picture) {
    int sum = 0;
    for (int y = 0; y < picture.height(); ++y) {
      for (int x = 2 * picture.width() / 3; x < picture.width(); ++x) {
        sum += picture.at(x, y, 1) - picture.at(x, y, 0);
      }
    }
    return sum;
  }

  testing::TemporaryDirectory directory_;
  std::optional<testing::Process> display_;
  std::string said_;
};

TEST_F(Viewer, PaintsTakesBackAndSavesWhatItPainted) {
  ASSERT_EQ(view({"--width",  "800",
                  "--height", "600",
                  "--do",     "screenshot " + file("before.png"),
                  "--do",     "brush operation paint",
                  "--do",     "brush value 0.9,0.01,0.01",
                  "--do",     "paint 0.72 0.55",
                  "--do",     "screenshot " + file("painted.png"),
                  "--do",     "save ring " + file("ring.vdb"),
                  "--do",     "undo",
                  "--do",     "screenshot " + file("undone.png")}),
            0)
      << said_;
  const int before = green_less_red(picture("before.png"));
  EXPECT_GT(green_less_red(picture("painted.png")), before + 10'000) << said_;
  EXPECT_NEAR(green_less_red(picture("undone.png")), before, 500);
  const auto material = read_material(directory_.path() / "ring.vdb");
  ASSERT_TRUE(material) << material.error().message;
  EXPECT_NEAR(*std::ranges::max_element(material->channels[0].absorption), 0.9, 0.01);
}

TEST_F(Viewer, AScriptedStrokeIsOneAndSaysWhatItTouched) {
  const auto steps = directory_.path() / "steps";
  std::filesystem::create_directory(steps);
  ASSERT_EQ(view({"--width",
                  "800",
                  "--height",
                  "600",
                  "--step-pictures",
                  steps.string(),
                  "--do",
                  "brush operation paint",
                  "--do",
                  "brush value 0.9,0.01,0.01",
                  "--do",
                  "brush radius 1.5",
                  "--do",
                  "stroke 0.70 0.50 0.74 0.60",
                  "--do",
                  "undo",
                  "--do",
                  "redo",
                  "--do",
                  "undo",
                  "--do",
                  "undo",
                  "--do",
                  "paint 0.99 0.01",
                  "--do",
                  "save ring " + file("ring.vdb")}),
            0)
      << said_;
  EXPECT_THAT(said_, MatchesRegex(".*paint +[1-9][0-9]+ cells by [1-9][0-9]+ dabs\n.*"));
  EXPECT_THAT(said_, HasSubstr("undo     there is none"));
  EXPECT_THAT(said_, HasSubstr("paint    0 cells: nothing is seen there"));
  EXPECT_THAT(said_, MatchesRegex(".*save +.*ring.vdb: origin = .*"));
  const int before = green_less_red(picture("steps/03-brush.png"));
  const int painted = green_less_red(picture("steps/04-stroke.png"));
  EXPECT_GT(painted, before + 10'000) << said_;
  EXPECT_NEAR(green_less_red(picture("steps/05-undo.png")), before, 500);
  EXPECT_NEAR(green_less_red(picture("steps/06-redo.png")), painted, 500);
  EXPECT_NEAR(green_less_red(picture("steps/07-undo.png")), before, 500);
}

TEST_F(Viewer, LivesThroughResizingMinimisingAndALostDevice) {
  ASSERT_EQ(
      view({"--do", "resize 500 400", "--do",     "wait 2",     "--do",         "minimise",
            "--do", "wait 3",         "--do",     "restore",    "--do",         "wait 2",
            "--do", "lose",           "--do",     "orbit 30 5", "--do",         "light 0 40 0",
            "--do", "tolerance 0.01", "--frames", "12",         "--screenshot", file("end.png")}),
      0)
      << said_;
  EXPECT_EQ(picture("end.png").width(), 500);
  EXPECT_EQ(picture("end.png").height(), 400);
}

TEST_F(Viewer, SaysWhatItDoesNotUnderstandBeforeItOpensAWindow) {
  EXPECT_EQ(view({"--do", "paint 0.5"}), 2);
  EXPECT_THAT(said_, HasSubstr("1 words follow paint; expected 2"));
  EXPECT_EQ(view({"--do", "dance"}), 2);
  EXPECT_THAT(said_, HasSubstr("\"dance\": unknown; there are: orbit"));
}

TEST_F(Viewer, WithoutADisplayFailsWithTheReason) {
  EXPECT_EQ(view({"--frames", "1"}, /*with_display=*/false), 1);
  EXPECT_THAT(said_, HasSubstr("DISPLAY"));
}

}  // namespace
}  // namespace opaline
