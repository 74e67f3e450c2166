#include "base/io/dng.h"

#include <gmock/gmock.h>

#include "base/io/image_io.h"
#include "tests/support/dng_file.h"

namespace opaline {
namespace {

using support::DngOptions;
using support::make_dng;
using ::testing::HasSubstr;

constexpr int kWidth = 96;
constexpr int kHeight = 64;

/// A mosaic with a code of its own in each pixel of some neighbourhood, over the whole range.
DngOptions mosaic() {
  DngOptions options{.width = kWidth, .height = kHeight};
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x)
      options.codes.push_back(static_cast<std::uint16_t>((7 * x + 131 * y) % 4080));
  return options;
}
int code(const DngOptions& options, int x, int y) {
  return options.codes[static_cast<std::size_t>(y) * options.width + static_cast<std::size_t>(x)];
}
Image<std::uint16_t> decoded(const DngOptions& options) {
  auto file = decode_image(make_dng(options));
  EXPECT_TRUE(file) << file.error().message;
  const auto* pixels = file ? std::get_if<Image<std::uint16_t>>(&file->pixels) : nullptr;
  return pixels != nullptr ? *pixels : Image<std::uint16_t>(1, 1, 3);
}
std::string refusal(const std::vector<std::byte>& bytes, const ImageLimits& limits = {}) {
  const auto file = decode_image(bytes, limits);
  return file ? "" : file.error().message;
}

/// Red above left, unless the options say otherwise: whole codes, whatever their size, as they were written.
void expect_codes(const DngOptions& options, int left, int top) {
  const Image<std::uint16_t> pixels = decoded(options);
  ASSERT_EQ(pixels.channels(), 3);
  for (int y = 0; y < pixels.height(); ++y) {
    for (int x = 0; x < pixels.width(); ++x) {
      const int u = left + 2 * x;
      const int v = top + 2 * y;
      const int green = (code(options, u + 1, v) + code(options, u, v + 1) + 1) / 2;
      ASSERT_EQ(pixels.at(x, y, 0), code(options, u, v)) << x << ", " << y;
      ASSERT_EQ(pixels.at(x, y, 1), green) << x << ", " << y;
      ASSERT_EQ(pixels.at(x, y, 2), code(options, u + 1, v + 1)) << x << ", " << y;
    }
  }
}

TEST(Dng, GivesTheSensorsCodesAsTheyWereWritten) {
  const auto pixels = decoded(mosaic());
  EXPECT_EQ(pixels.width(), kWidth / 2);
  EXPECT_EQ(pixels.height(), kHeight / 2);
  expect_codes(mosaic(), 0, 0);
}

TEST(Dng, SaysBlackAndWhite) {
  const auto file = decode_image(make_dng(mosaic()));
  ASSERT_TRUE(file);
  EXPECT_EQ(file->metadata.at("black_level"), "64");
  EXPECT_EQ(file->metadata.at("white_level"), "4095");
}

TEST(Dng, ReadsOtherByteOrdersAndPicturesBehindASmallOne) {
  DngOptions options = mosaic();
  options.big_endian = true;
  expect_codes(options, 0, 0);
  options.behind_preview = true;
  expect_codes(options, 0, 0);
}

TEST(Dng, BeginsAtTheActiveAreaAndIsNotTurned) {
  DngOptions options = mosaic();
  options.active = {4, 6, 60, 90};
  EXPECT_EQ(decoded(options).width(), 42);
  EXPECT_EQ(decoded(options).height(), 28);
  expect_codes(options, 6, 4);
  options.orientation = 6;  // held upright
  expect_codes(options, 6, 4);
}

TEST(Dng, FindsTheColorsOfOtherPatterns) {
  DngOptions options = mosaic();
  options.pattern = {1, 2, 0, 1};  // green blue, red green
  const auto pixels = decoded(options);
  EXPECT_EQ(pixels.at(5, 7, 0), code(options, 10, 15));
  EXPECT_EQ(pixels.at(5, 7, 2), code(options, 11, 14));
}

TEST(Dng, KeepsAPixelClippedOfWhichOneGreenIs) {
  DngOptions options = mosaic();
  options.codes[1] = 4095;
  options.codes[kWidth] = 1000;
  EXPECT_EQ(decoded(options).at(0, 0, 1), 4095);
}

TEST(Dng, ReadsLinearRaw) {
  DngOptions options{.width = 8, .height = 6, .linear_raw = true};
  for (int i = 0; i < 8 * 6 * 3; ++i) options.codes.push_back(static_cast<std::uint16_t>(25 * i));
  const auto pixels = decoded(options);
  ASSERT_EQ(pixels.width(), 8);
  EXPECT_TRUE(std::ranges::equal(pixels.samples(), options.codes));
  options.behind_preview = true;
  EXPECT_THAT(refusal(make_dng(options)), HasSubstr("convert"));
}

TEST(Dng, RefusesWhatIsTooLarge) {
  EXPECT_THAT(refusal(make_dng(mosaic()), {.pixels = 1000}), HasSubstr("at most 1000"));
  EXPECT_THAT(refusal(make_dng(mosaic()), {.bytes = 1000}), HasSubstr("at most 1000"));
  EXPECT_THAT(refusal(make_dng(mosaic()), {.channels = 1}), HasSubstr("channels"));
}

TEST(Dng, RefusesWhatItCannotRead) {
  DngOptions options = mosaic();
  options.pattern = {0, 1, 2, 3};
  EXPECT_THAT(refusal(make_dng(options)), HasSubstr("no mosaic of red, green"));
  options = mosaic();
  options.active = {0, 0, 100, 200};
  EXPECT_THAT(refusal(make_dng(options)), HasSubstr("size"));
}

// Whatever is cut off or changed of it: an answer or an error, and no picture that is partly made up.
TEST(Dng, RefusesTruncatedFiles) {
  const auto whole = make_dng(mosaic());
  for (std::size_t size = 8; size < whole.size(); size += 97) {
    const std::vector<std::byte> part(whole.begin(),
                                      whole.begin() + static_cast<std::ptrdiff_t>(size));
    EXPECT_NE(refusal(part), "") << size;
  }
}
TEST(Dng, SurvivesDamagedTags) {
  const auto whole = make_dng(mosaic());
  for (std::size_t at = 4; at < 400; ++at) {
    for (const int flip : {0xFF, 0x01}) {
      auto damaged = whole;
      damaged[at] ^= static_cast<std::byte>(flip);
      static_cast<void>(refusal(damaged));
    }
  }
}

}  // namespace
}  // namespace opaline
