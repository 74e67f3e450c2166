// An object of a session's material, shown and edited over the daemon's routes, by the real opaline-preview.

#include <gmock/gmock.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "base/files.h"
#include "base/io/image_io.h"
#include "base/io/volume_io.h"
#include "config/session_config.h"
#include "daemon/live_objects.h"
#include "daemon/preview/stroke_text.h"
#include "daemon/routes/objects.h"
#include "tests/support/named_directory.h"
#include "tests/support/process.h"
#include "tests/support/temporary_directory.h"

namespace opaline::daemon {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using testing::eventually;
using ::testing::HasSubstr;
using ::testing::Not;
using testing::Process;

constexpr std::chrono::seconds kPatience{20};

fs::path programs() { return testing::named_directory("OPALINE_BIN_DIR"); }

/// Scatters evenly, and absorbs the same in all colours.
Material plain_material() {
  Material material;
  material.block = {12, 12, 6, 2.0, 2.0, 2.0};
  material.ior = 1.4;
  for (auto& channel : material.channels) {
    channel.absorption.assign(material.block.cell_count(), 0.02);
    channel.reduced_scattering.assign(material.block.cell_count(), 1.0);
  }
  return material;
}

class LiveObjectTest : public ::testing::Test {
 protected:
  LiveObjectTest() {
    auto parsed = config::parse_session({"session.toml", "rig = \"rig.toml\"\n", directory_.path()},
                                        {"rig.toml", "", directory_.path()});
    EXPECT_TRUE(parsed) << parsed.error().message;
    config::SessionConfig config = *std::move(parsed);
    config.sample.block = plain_material().block;
    config.preview.object_tetrahedra = 2000;
    make_session("session", config);
    config.kind = config::SessionKind::kLedSphere;
    sphere_ = config;
    add_object_routes(router_, objects_);
  }
  void make_session(const char* name, const config::SessionConfig& config) {
    auto made = SessionDirectory::create(
        system_files(), directory_.path() / name, {"test", "", "", config::to_toml(config)});
    EXPECT_TRUE(made) << made.error().message;
    session_.emplace(*std::move(made));
  }
  void TearDown() override {
    ask("DELETE", "");
    eventually([&] { return state() != "running" && state() != "starting"; });
  }

  void find_material() {
    ASSERT_TRUE(write_material(system_files(), session_->material(), plain_material(), "test"));
  }
  HttpResponse ask(const char* method, const std::string& below, const std::string& body = "") {
    HttpRequest request;
    request.method = method;
    request.path = *split_path("/v1/sessions/one/object" + below);
    request.headers["content-type"] = "application/json";
    request.body = body;
    return router_.handle(request);
  }
  HttpResponse wish(const std::string& json) { return ask("POST", "/wishes", json); }
  nlohmann::json look() { return nlohmann::json::parse(ask("GET", "").body, nullptr, false); }
  std::string state() { return look().value("state", ""); }
  /// Starts, and waits for the first picture.
  void show() {
    find_material();
    ASSERT_EQ(ask("POST", "").status, 202);
    ASSERT_TRUE(eventually([&] { return look().value("frame", 0) > 0; }, kPatience))
        << look().dump();
  }
  /// Waits for another picture than the one before.
  bool shows(const std::string& figure, const nlohmann::json& value) {
    return eventually([&] { return look().value(figure, nlohmann::json()) == value; }, kPatience);
  }
  Image<std::uint8_t> picture() {
    const HttpResponse response = ask("GET", "/picture");
    EXPECT_EQ(response.status, 200);
    const auto image = decode_image(std::as_bytes(std::span(response.body)));
    EXPECT_TRUE(image);
    return std::get<Image<std::uint8_t>>(image->pixels);
  }
  fs::path scene_file() const { return session_->preview() / "object.toml"; }

  testing::TemporaryDirectory directory_;
  std::optional<SessionDirectory> session_;
  config::SessionConfig sphere_;
  LocalExecutor executor_{programs()};
  LiveObjects objects_{[this](const std::string& id) -> Result<SessionDirectory> {
                         if (id != "one") return not_found("there is no such session");
                         return *session_;
                       },
                       executor_,
                       system_files()};
  Router router_;
};

/// Mean codes of red, green and blue where the ring is seen, about the picture's middle.
std::array<double, 3> mean_codes(const Image<std::uint8_t>& picture) {
  std::array<double, 3> sums{};
  for (int y = 120; y < 360; ++y) {
    for (int x = 160; x < 480; ++x) {
      for (int c = 0; c < 3; ++c) sums[c] += picture.at(x, y, c) / (240.0 * 320.0);
    }
  }
  return sums;
}

int largest_difference(const Image<std::uint8_t>& a, const Image<std::uint8_t>& b) {
  int largest = 0;
  for (std::size_t i = 0; i < a.samples().size(); ++i)
    largest = std::max(largest, std::abs(a.samples()[i] - b.samples()[i]));
  return largest;
}

constexpr const char* kDarkenGreenAndBlue =
    R"({"command":"edit","stroke":{"operation":"scale","quantity":"absorption","value":[1,40,40],
        "reach":"through","radius_mm":60}})";

TEST_F(LiveObjectTest, ShowsAStrokeAndTakesItBackAndDoesItAgain) {
  show();
  const auto before = picture();
  const std::string scene = read_text(scene_file()).value();

  EXPECT_EQ(wish(kDarkenGreenAndBlue).status, 202);
  EXPECT_THAT(read_text(scene_file()).value(), HasSubstr("value = [1, 40, 40]"));
  ASSERT_TRUE(shows("edits", 1)) << look().dump();
  const auto after = picture();
  EXPECT_NEAR(mean_codes(after)[0], mean_codes(before)[0], 0.5);  // a factor of one
  EXPECT_LT(mean_codes(after)[1], mean_codes(before)[1] - 5.0);

  EXPECT_EQ(wish(R"({"command":"undo"})").status, 202);
  ASSERT_TRUE(shows("edits", 0)) << look().dump();
  EXPECT_EQ(read_text(scene_file()).value(), scene);
  EXPECT_LE(largest_difference(picture(), before), 1);  // solved to 1e-5 from another start
  EXPECT_EQ(wish(R"({"command":"undo"})").status, 409);

  EXPECT_EQ(wish(R"({"command":"redo"})").status, 202);
  ASSERT_TRUE(shows("edits", 1)) << look().dump();
  EXPECT_LE(largest_difference(picture(), after), 1);
}

TEST_F(LiveObjectTest, FollowsTheLightOnceNothingIsWished) {
  show();
  const auto before = picture();
  ASSERT_TRUE(look().value("settled", false));

  ASSERT_EQ(wish(kDarkenGreenAndBlue).status, 202);
  ASSERT_TRUE(shows("frame", 2)) << look().dump();
  EXPECT_FALSE(look().value("settled", true)) << look().dump();
  const auto moving = picture();
  ASSERT_TRUE(shows("frame", 3)) << look().dump();
  EXPECT_TRUE(look().value("settled", false)) << look().dump();

  const auto settled = picture();
  EXPECT_GT(largest_difference(moving, before), 5);
  EXPECT_GT(largest_difference(settled, moving), 0);
  EXPECT_LT(largest_difference(settled, moving), largest_difference(moving, before));
  ASSERT_EQ(wish(R"({"command":"look","position_mm":[0,0,60],"target_mm":[0,0.1,0]})").status, 202);
  ASSERT_TRUE(shows("frame", 4)) << look().dump();
  EXPECT_TRUE(look().value("settled", false)) << look().dump();
}

TEST_F(LiveObjectTest, LooksFromElsewhereUnderAnotherLight) {
  show();
  const auto before = picture();
  EXPECT_EQ(wish(R"({"command":"look","position_mm":[0,0,60],"target_mm":[0,0.1,0]})").status, 202);
  ASSERT_TRUE(shows("frame", 2)) << look().dump();
  EXPECT_GT(largest_difference(picture(), before), 30);
  EXPECT_EQ(wish(R"({"command":"shine","light":0,"direction":[0,0,1]})").status, 202);
  ASSERT_TRUE(shows("frame", 3)) << look().dump();
  const auto from_below = mean_codes(picture());
  EXPECT_EQ(wish(R"({"command":"shine","light":0,"direction":[0,0,-1]})").status, 202);
  ASSERT_TRUE(shows("frame", 4)) << look().dump();
  EXPECT_GT(mean_codes(picture())[0], 1.5 * from_below[0]);  // the floor was in the way
  EXPECT_EQ(wish(R"({"command":"shine","light":1,"direction":[0,0,1]})").status, 400);
  EXPECT_EQ(wish(R"({"command":"look","position_mm":[0,0,0],"target_mm":[0,0,0]})").status, 400);
}

TEST_F(LiveObjectTest, RefusesWhatASceneWouldRefuseAndLeavesTheFileAlone) {
  show();
  const std::string scene = read_text(scene_file()).value();
  for (const char* bad : {R"({"command":"edit"})",
                          R"({"command":"edit","stroke":{"value":[1,2]}})",
                          R"({"command":"edit","stroke":{"value":[1,2,1e300]}})",
                          R"({"command":"edit","stroke":{"value":[1,1,1],"radius_mm":-1}})",
                          R"({"command":"edit","stroke":{"value":[1,1,1],"mask":"/etc/passwd"}})",
                          R"({"command":"edit","stroke":{"value":[1,1,1],"reach":"a\" b"}})",
                          R"({"command":"cancel"})",
                          R"([])",
                          "nonsense"}) {
    const HttpResponse answer = wish(bad);
    EXPECT_EQ(answer.status, 400) << bad << answer.body;
  }
  EXPECT_EQ(read_text(scene_file()).value(), scene);
  EXPECT_EQ(look()["frame"], 1);
}

TEST_F(LiveObjectTest, FollowsTheFileAndSaysWhatIsWrongWithIt) {
  show();
  const std::string scene = read_text(scene_file()).value();
  const auto before = picture();
  std::string larger = scene;
  larger.replace(larger.find("28 deg"), 6, "14 deg");
  ASSERT_TRUE(write_whole(system_files(), scene_file(), larger));
  ASSERT_TRUE(shows("frame", 2)) << look().dump();
  EXPECT_GT(largest_difference(picture(), before), 30);
  const auto after = picture();
  ASSERT_TRUE(write_whole(system_files(), scene_file(), "nonsense = 1\n" + scene));
  ASSERT_TRUE(eventually([&] { return !look()["message"].get<std::string>().empty(); }));
  EXPECT_THAT(look()["message"].get<std::string>(), HasSubstr("object.toml:1:1"));
  EXPECT_EQ(largest_difference(picture(), after), 0);
  ASSERT_TRUE(write_whole(system_files(), scene_file(), scene));
  ASSERT_TRUE(shows("message", "")) << look().dump();
  EXPECT_LE(largest_difference(picture(), before), 1);
}

TEST_F(LiveObjectTest, WaitsForAMaterialAndIsShownOnce) {
  EXPECT_EQ(ask("GET", "").status, 404);
  EXPECT_EQ(ask("POST", "").status, 409);  // no material yet
  EXPECT_EQ(wish(kDarkenGreenAndBlue).status, 404);
  show();
  EXPECT_EQ(ask("POST", "").status, 202);
  EXPECT_EQ(look()["frame"], 1);
  Process second({(programs() / "opaline-preview").string(), "--live", session_->path().string()},
                 {},
                 directory_.path() / "second");
  EXPECT_EQ(second.wait(), 4) << second.output();
  EXPECT_EQ(ask("DELETE", "").status, 202);
  EXPECT_TRUE(shows("state", "over")) << look().dump();
  EXPECT_EQ(ask("DELETE", "").status, 409);
  EXPECT_EQ(wish(kDarkenGreenAndBlue).status, 409);
}

TEST_F(LiveObjectTest, SaysWhatShowsTheObjectOfASphereOfLights) {
  make_session("sphere", sphere_);
  find_material();

  ASSERT_EQ(ask("POST", "").status, 202);

  ASSERT_TRUE(eventually([&] { return state() == "failed"; }, kPatience)) << look().dump();
  EXPECT_THAT(look().value("message", ""), HasSubstr("opaline view"));
  EXPECT_FALSE(fs::exists(scene_file()));
}

TEST_F(LiveObjectTest, StreamsItsFigures) {
  show();
  auto stream = ask("GET", "/events").stream;
  ASSERT_TRUE(stream);
  EXPECT_THAT(stream->next(), AllOf(HasSubstr("event: view"), HasSubstr("\"relative_residual\"")));
  ask("DELETE", "");
  std::string last;
  EXPECT_TRUE(eventually([&] {
    last += stream->next();
    return stream->is_over();
  }));
  EXPECT_THAT(last, HasSubstr("event: over"));
}

TEST(StrokeText, SaysWhatTheStrokeSays) {
  const auto text = stroke_text({{"operation", "scale"},
                                 {"value", {1, 2.5, 3}},
                                 {"centre_mm", {0, -1, 2}},
                                 {"radius_mm", 4}});
  ASSERT_TRUE(text) << text.error().message;
  EXPECT_THAT(*text,
              AllOf(HasSubstr("[[objects.edits]]\n"),
                    HasSubstr("operation = \"scale\"\n"),
                    HasSubstr("value = [1, 2.5, 3]\n"),
                    HasSubstr("centre = [\"0 mm\", \"-1 mm\", \"2 mm\"]\n"),
                    HasSubstr("radius = \"4 mm\"\n"),
                    Not(HasSubstr("_mm"))));
}

}  // namespace
}  // namespace opaline::daemon
