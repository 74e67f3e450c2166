#include <gmock/gmock.h>
#include <gtest/gtest.h>

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
