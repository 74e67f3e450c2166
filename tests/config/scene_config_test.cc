#include "config/scene_config.h"

#include <gmock/gmock.h>

#include "base/files.h"
#include "tests/support/named_directory.h"

namespace opaline::config {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::StartsWith;

fs::path config_file(const char* name) {
  return opaline::testing::named_directory("OPALINE_SOURCE_DIR") / "config" / name;
}

/// A small scene with some text replaced.
std::string scene_with(std::string_view what, std::string_view with) {
  std::string text = R"([camera]
position = ["40 mm", "0 mm", "0 mm"]
[[lights]]
kind = "spot"
position = ["0 mm", "0 mm", "40 mm"]
direction = [0, 0, -1]
intensity = [1, 1, 1]
[[objects]]
shape = "torus"
size = "20 mm"
[objects.material]
absorption = [0.01, 0.01, 0.01]
reduced_scattering = [1, 1, 1]
)";
  const std::size_t at = text.find(what);
  EXPECT_NE(at, std::string::npos) << what;
  return text.replace(at, what.size(), with);
}

Result<render::Scene> parsed(const std::string& text) {
  return parse_scene({"scene.toml", text, "/scenes"});
}

std::string refusal(std::string_view what, std::string_view with) {
  const auto scene = parsed(scene_with(what, with));
  return scene ? "accepted" : scene.error().message;
}

TEST(SceneConfig, ShowsItsKeysInTheExampleAndReadsThem) {
  EXPECT_EQ(read_text(config_file("scene.example.toml")).value(), scene_example());
  const auto scene = load_scene(config_file("scene.example.toml"));
  ASSERT_TRUE(scene) << scene.error().message;
  EXPECT_EQ(scene->lights.size(), 4U);
  EXPECT_EQ(scene->objects.size(), 2U);
  EXPECT_EQ(scene->objects[1].kind, render::ObjectOptions::Kind::kOpaque);
}

TEST(SceneConfig, AcceptsTheScenesThatComeWithTheProgram) {
  for (const char* name :
       {"scene_marble_torus.toml", "scene_wax_figurine.toml", "scene_beam_in_ball.toml"}) {
    const auto scene = load_scene(config_file(name));
    EXPECT_TRUE(scene) << scene.error().message;
  }
}

TEST(SceneConfig, ReadsWhatIsWritten) {
  const auto scene =
      parsed(scene_with("shape = \"torus\"", "file = \"bunny.ply\"\nunit = \"1 m\""));
  ASSERT_TRUE(scene) << scene.error().message;
  EXPECT_EQ(scene->objects[0].shape.file, "/scenes/bunny.ply");
  EXPECT_EQ(scene->objects[0].shape.unit_mm, 1000.0);
  EXPECT_EQ(scene->lights[0].kind, render::LightOptions::Kind::kSpot);
  EXPECT_EQ(scene->camera.position, (Vec3{40.0, 0.0, 0.0}));
}

TEST(SceneConfig, ReadsAShellOnlyWhereABlockIsWrappedAround) {
  const std::string_view coefficients =
      "absorption = [0.01, 0.01, 0.01]\nreduced_scattering = [1, 1, 1]";
  const auto shell = parsed(scene_with(
      coefficients, "file = \"wax.vdb\"\nplacement = \"shell\"\nshell_depth = \"3 mm\""));
  ASSERT_TRUE(shell) << shell.error().message;
  EXPECT_EQ(shell->objects[0].material.placement, render::Placement::kShell);
  EXPECT_EQ(shell->objects[0].material.shell_depth_mm, 3.0);
  EXPECT_THAT(refusal(coefficients, "file = \"wax.vdb\"\nshell_depth = \"3 mm\""),
              HasSubstr("unknown key \"shell_depth\""));
}

TEST(SceneConfig, ReadsAMeasuredSurfaceWithItsMaterial) {
  const std::string_view coefficients =
      "absorption = [0.01, 0.01, 0.01]\nreduced_scattering = [1, 1, 1]";
  const auto scene =
      parsed(scene_with(coefficients, "file = \"wax.vdb\"\nsurface_reflectance = \"wax.exr\""));
  ASSERT_TRUE(scene) << scene.error().message;
  EXPECT_EQ(scene->objects[0].material.surface_reflectance, "/scenes/wax.exr");
  EXPECT_THAT(refusal("absorption = [0.01, 0.01, 0.01]", "surface_reflectance = \"wax.exr\""),
              HasSubstr("unknown key \"surface_reflectance\""));
}

TEST(SceneConfig, RefusesWhatItCannotMeanWithPlaceAndRemedy) {
  EXPECT_THAT(refusal("size =", "sise ="),
              AllOf(HasSubstr("scene.toml:10:1: unknown key \"sise\" in [objects 1]"),
                    HasSubstr("did you mean \"size\"?")));
  EXPECT_THAT(refusal("direction = [0, 0, -1]", "direction = [0, 0, 0]"),
              AllOf(StartsWith("scene.toml:6:"), HasSubstr("a vector that is not 0")));
  EXPECT_THAT(refusal("kind = \"spot\"", "kind = \"point\""),
              HasSubstr("unknown key \"direction\" in [lights 1]"));
  EXPECT_THAT(refusal("\"torus\"", "\"plane\""), HasSubstr("a plane encloses nothing"));
  EXPECT_THAT(refusal("shape = \"torus\"", "name = \"x\""),
              HasSubstr("expected either shape or file"));
  EXPECT_THAT(refusal("size = \"20 mm\"", ""), HasSubstr("such as \"20 mm\""));
  EXPECT_THAT(refusal("size = \"20 mm\"", "size = 20"), HasSubstr("a length with its unit"));
  EXPECT_THAT(refusal("reduced_scattering = [1, 1, 1]", "reduced_scattering = [1, 0, 1]"),
              HasSubstr("scene.toml:13:26: reduced_scattering is 0; expected"));
  EXPECT_THAT(refusal("reduced_scattering = [1, 1, 1]", ""),
              HasSubstr("missing key \"reduced_scattering\" in [objects 1.material]"));
  EXPECT_THAT(refusal("intensity = [1, 1, 1]", "intensity = [0, 0, 0]"),
              HasSubstr("expected light in some channel"));
  EXPECT_THAT(refusal("position = [\"40 mm\", \"0 mm\", \"0 mm\"]",
                      "position = [\"0 mm\", \"0 mm\", \"9 mm\"]"),
              HasSubstr("not along the view"));
  EXPECT_THAT(refusal("[[lights]]", "[lights]"), HasSubstr("tables, each headed [[lights]]"));
  EXPECT_THAT(refusal("[[objects]]", "[[things]]"), HasSubstr("unknown key \"things\""));
}

TEST(SceneConfig, WantsAnObjectAndLight) {
  EXPECT_THAT(parsed("").error().message,
              AllOf(HasSubstr("missing key \"objects\""), HasSubstr("nothing shines")));
}

}  // namespace
}  // namespace opaline::config
