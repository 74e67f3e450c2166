#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <thread>

#include "base/clock.h"
#include "base/files.h"
#include "base/io/image_io.h"
#include "drivers/replay/replay_camera.h"
#include "tests/support/photograph_folder.h"
#include "tests/support/temporary_directory.h"

namespace opaline::drivers {
namespace {

using namespace std::chrono_literals;
using ::testing::HasSubstr;

class ReplayTest : public ::testing::Test {
 protected:
  void SetUp() override { support::write_photographs(folder()); }
  std::filesystem::path folder() const { return directory_.path() / "photographs"; }
  void write_index(std::string_view text) {
    ASSERT_TRUE(write_whole(system_files(), folder() / "index.toml", text));
  }
  std::string problem() {
    const auto index = read_replay_index(folder());
    return index ? "none" : index.error().message;
  }

  testing::TemporaryDirectory directory_;
  ManualClock clock_;
};

TEST_F(ReplayTest, PicksThePatternAndTheNearestExposure) {
  ReplayCamera camera(folder(), clock_);
  ASSERT_TRUE(camera.open());
  for (const std::uint64_t pattern : {0u, 1u, 2u, 3u}) {  // PNG, TIFF, EXR, PNG
    for (const bool long_exposure : {false, true}) {
      const auto frame = camera.capture({long_exposure ? 400ms : 250ms, pattern}, {});
      ASSERT_TRUE(frame) << frame.error().message;
      EXPECT_EQ(frame->pattern_id, pattern);
      EXPECT_EQ(frame->exposure, long_exposure ? 1s : 100ms);
      EXPECT_EQ(frame->pixels.at(5, 3, 1),
                support::photograph_code(pattern, long_exposure, 5, 3, 1));
    }
  }
}

TEST_F(ReplayTest, NamesThePatternThatIsNotThere) {
  ReplayCamera camera(folder(), clock_);
  ASSERT_TRUE(camera.open());
  const auto frame = camera.capture({100ms, 17}, {});
  ASSERT_FALSE(frame);
  EXPECT_EQ(frame.error().code, ErrorCode::kNotFound);
  EXPECT_THAT(frame.error().message,
              HasSubstr("no photograph of pattern 17; there are 0 (flat_0), 1 (flat_1)"));
}

TEST_F(ReplayTest, ATruncatedOrExchangedPhotographIsNamed) {
  const auto file = folder() / "pattern_1_short.tif";
  std::filesystem::resize_file(file, std::filesystem::file_size(file) / 2);
  ReplayCamera camera(folder(), clock_);
  ASSERT_TRUE(camera.open());
  const auto frame = camera.capture({100ms, 1}, {});
  ASSERT_FALSE(frame);
  EXPECT_EQ(frame.error().code, ErrorCode::kUnavailable);
  EXPECT_THAT(frame.error().message, HasSubstr("pattern_1_short.tif: SHA-256 differs"));
}

TEST_F(ReplayTest, EightBitGreyPhotographsCountForThreeChannels) {
  const Image<std::uint8_t> grey(8, 6, 1, 77);
  ASSERT_TRUE(write_whole(
      system_files(), folder() / "grey.png", *encode_image({grey, {}, {}}, ImageFormat::kPng)));
  write_index(
      "[camera]\nwidth = 8\nheight = 6\nbit_depth = 8\n[[photograph]]\nfile = "
      "\"grey.png\"\npattern_id = 4\nexposure_s = 0.5\n");
  ReplayCamera camera(folder(), clock_);
  ASSERT_TRUE(camera.open());
  const auto frame = camera.capture({500ms, 4}, {});
  ASSERT_TRUE(frame) << frame.error().message;
  EXPECT_EQ(frame->bit_depth, 8);
  EXPECT_EQ(frame->pixels, Image<std::uint16_t>(8, 6, 3, 77));
}

TEST_F(ReplayTest, EightBitColourInTiffAndPng) {
  Image<std::uint8_t> picture(8, 6, 3, 40);
  picture.at(5, 3, 1) = 41;
  std::string index = "[camera]\nwidth = 8\nheight = 6\nbit_depth = 8\n";
  for (const char* name : {"colour.png", "colour.tif"}) {
    ASSERT_TRUE(write_whole(
        system_files(), folder() / name, *encode_image({picture, {}, {}}, *image_format_of(name))));
    index += fmt::format(
        "[[photograph]]\nfile = \"{}\"\npattern = \"{}\"\nexposure_s = 0.5\n", name, name);
  }
  write_index(index);
  ReplayCamera camera(folder(), clock_);
  ASSERT_TRUE(camera.open());
  for (const char* name : {"colour.png", "colour.tif"}) {
    const auto frame = camera.capture({500ms, 7, name}, {});
    ASSERT_TRUE(frame) << frame.error().message;
    EXPECT_EQ(frame->pixels.at(5, 3, 0), 40);
    EXPECT_EQ(frame->pixels.at(5, 3, 1), 41);
  }
}

TEST_F(ReplayTest, AnEightBitPhotographAmongTwelveBitOnesIsRefused) {
  const Image<std::uint8_t> picture(8, 6, 3, 40);
  ASSERT_TRUE(write_whole(
      system_files(), folder() / "eight.png", *encode_image({picture, {}, {}}, ImageFormat::kPng)));
  write_index(
      "[camera]\nwidth = 8\nheight = 6\n[[photograph]]\nfile = \"eight.png\"\npattern_id = "
      "4\nexposure_s = 0.5\n");
  ReplayCamera camera(folder(), clock_);
  ASSERT_TRUE(camera.open());
  const auto frame = camera.capture({500ms, 4}, {});  // would be sixteen times too dark
  ASSERT_FALSE(frame);
  EXPECT_THAT(frame.error().message, HasSubstr("eight.png: has 8 bits, and the index says"));
}

void append(std::string& bytes, auto value) {
  bytes.append(reinterpret_cast<const char*>(&value), sizeof(value));
}

/// One line of an OpenEXR file, uncompressed, three channels of halves, as photographs are kept by most programs.
std::string half_exr(const std::vector<std::uint16_t>& halves_of_each_channel) {
  const auto width = static_cast<std::int32_t>(halves_of_each_channel.size());
  std::string exr("\x76\x2f\x31\x01\x02\0\0\0", 8);
  const auto attribute =
      [&](const std::string& name, const std::string& type, const std::string& value) {
        exr += name + '\0' + type + '\0';
        append(exr, static_cast<std::int32_t>(value.size()));
        exr += value;
      };
  std::string channels;
  for (const char* name : {"B", "G", "R"}) {
    channels += std::string(name) + '\0';
    for (const std::int32_t field : {1, 0, 1, 1}) append(channels, field);  // half, linear, 1 x 1
  }
  std::string window;
  for (const std::int32_t edge : {0, 0, width - 1, 0}) append(window, edge);
  attribute("channels", "chlist", channels + '\0');
  attribute("compression", "compression", std::string(1, '\0'));
  attribute("dataWindow", "box2i", window);
  attribute("displayWindow", "box2i", window);
  attribute("lineOrder", "lineOrder", std::string(1, '\0'));
  attribute("pixelAspectRatio", "float", std::string("\0\0\x80\x3f", 4));
  attribute("screenWindowCenter", "v2f", std::string(8, '\0'));
  attribute("screenWindowWidth", "float", std::string("\0\0\x80\x3f", 4));
  exr += '\0';
  append(exr, static_cast<std::uint64_t>(exr.size() + 8));  // where the line begins
  append(exr, std::int32_t{0});
  append(exr, 6 * width);
  for (int channel = 0; channel < 3; ++channel) {
    for (const std::uint16_t half : halves_of_each_channel) append(exr, half);
  }
  return exr;
}

TEST_F(ReplayTest, HalfFloatsInExr) {
  ASSERT_TRUE(write_whole(
      system_files(), folder() / "half.exr", half_exr({0x3800, 0x3c00, 0x4000})));  // 0.5, 1, 2
  write_index(
      "[camera]\nwidth = 3\nheight = 1\ncodes_per_unit = 1000\n[[photograph]]\nfile = "
      "\"half.exr\"\npattern_id = 4\nexposure_s = 0.5\n");
  ReplayCamera camera(folder(), clock_);
  ASSERT_TRUE(camera.open());
  const auto frame = camera.capture({500ms, 4}, {});
  ASSERT_TRUE(frame) << frame.error().message;
  EXPECT_EQ(frame->pixels.at(0, 0, 2), 500);
  EXPECT_EQ(frame->pixels.at(1, 0, 0), 1000);
  EXPECT_EQ(frame->pixels.at(2, 0, 1), 2000);
}

TEST_F(ReplayTest, APatternMayBeKnownByItsName) {
  write_index(
      "[camera]\nwidth = 8\nheight = 6\n[[photograph]]\nfile = \"pattern_3_long.png\"\npattern = "
      "\"region_0_1\"\nexposure_s = 1\n");
  ReplayCamera camera(folder(), clock_);
  ASSERT_TRUE(camera.open());
  const auto frame = camera.capture({1s, 17, "region_0_1"}, {});
  ASSERT_TRUE(frame) << frame.error().message;
  EXPECT_EQ(frame->pattern_id, 17u);
  const auto other = camera.capture({1s, 18, "region_1_0"}, {});
  ASSERT_FALSE(other);
  EXPECT_THAT(other.error().message,
              HasSubstr("no photograph of pattern 18 (region_1_0); there are region_0_1"));
}

TEST_F(ReplayTest, ClosingFromAnotherThreadEndsACapture) {
  const Image<std::uint16_t> large(3000, 2000, 3, 1000);
  ASSERT_TRUE(write_whole(
      system_files(), folder() / "large.tif", *encode_image({large, {}, {}}, ImageFormat::kTiff)));
  write_index(
      "[camera]\nwidth = 3000\nheight = 2000\n[[photograph]]\nfile = \"large.tif\"\npattern_id = "
      "1\nexposure_s = 1\n");
  ReplayCamera camera(folder(), clock_);
  Result<Frame> frame = Frame{};
  for (int attempt = 0; attempt < 20 && frame; ++attempt) {  // until one is under way
    ASSERT_TRUE(camera.open());
    std::atomic<bool> begun = false;
    std::jthread capturing([&] {
      begun = true;
      frame = camera.capture({1s, 1}, {});
    });
    while (!begun) std::this_thread::yield();
    std::this_thread::sleep_for(2ms);
    EXPECT_TRUE(camera.info());  // does not wait
    camera.close();
  }
  ASSERT_FALSE(frame);
  EXPECT_EQ(frame.error().code, ErrorCode::kCancelled);
}

TEST_F(ReplayTest, PhotographsThatDoNotFitTheIndexAreRefused) {
  const char* const photograph =
      "[[photograph]]\nfile = \"pattern_3_long.png\"\npattern_id = 3\nexposure_s = 1\n";
  for (const char* camera_table :
       {"[camera]\nwidth = 9\nheight = 6\n", "[camera]\nwidth = 8\nheight = 6\nbit_depth = 8\n"}) {
    write_index(std::string(camera_table) + photograph);
    ReplayCamera camera(folder(), clock_);
    ASSERT_TRUE(camera.open());
    const auto frame = camera.capture({1s, 3}, {});
    ASSERT_FALSE(frame);
    EXPECT_THAT(frame.error().message, HasSubstr("pattern_3_long.png"));
  }
}

TEST_F(ReplayTest, IndexMistakesAreNamedWithTheirLine) {
  write_index("[camera]\nwidth = 8\n");
  EXPECT_THAT(problem(), HasSubstr("index.toml:1:1: [camera] without height"));
  write_index("[camera]\nwidth = 8\nheigth = 6\n");
  EXPECT_THAT(problem(), HasSubstr("unknown key \"heigth\""));
  write_index("[camera]\nwidth = 8\nheight = 6\n");
  EXPECT_THAT(problem(), HasSubstr("no [[photograph]]"));
  write_index(
      "[camera]\nwidth = 8\nheight = 6\n[[photograph]]\nfile = \"../x.png\"\npattern_id = "
      "1\nexposure_s = 1\n");
  EXPECT_THAT(problem(),
              HasSubstr("index.toml:4:1: file: expected the name of a photograph in the folder"));
  write_index(
      "[camera]\nwidth = 8\nheight = 6\n[[photograph]]\nfile = \"x.png\"\npattern_id = "
      "1.5\nexposure_s = 1\n");
  EXPECT_THAT(problem(), HasSubstr("index.toml:6:14: pattern_id: expected a whole number"));
  write_index(
      "[camera]\nwidth = 8\nheight = 6\n[[photograph]]\nfile = \"x.png\"\nexposure_s = 1\n");
  EXPECT_THAT(problem(), HasSubstr("index.toml:4:1: [[photograph]] without pattern or pattern_id"));
  write_index("[camera\n");
  EXPECT_THAT(problem(), HasSubstr("index.toml:1:"));
}

TEST_F(ReplayTest, AMissingFolderIsNotFound) {
  const auto index = read_replay_index(directory_.path() / "nowhere");
  ASSERT_FALSE(index);
  EXPECT_EQ(index.error().code, ErrorCode::kNotFound);
}

}  // namespace
}  // namespace opaline::drivers
