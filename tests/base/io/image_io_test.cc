#include "base/io/image_io.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

namespace opaline {
namespace {

using ::testing::HasSubstr;

template <class T>
Image<T> ramp(int width, int height, int channels) {
  Image<T> image(width, height, channels);
  std::size_t i = 0;
  for (T& sample : image.samples()) sample = static_cast<T>(i++ * 37);
  return image;
}

template <class T>
void expect_same_again(const ImageFile& file, ImageFormat format) {
  const auto bytes = encode_image(file, format);
  ASSERT_TRUE(bytes) << bytes.error().message;
  const auto back = decode_image(*bytes);
  ASSERT_TRUE(back) << back.error().message;
  ASSERT_TRUE(std::holds_alternative<Image<T>>(back->pixels));
  EXPECT_EQ(std::get<Image<T>>(back->pixels), std::get<Image<T>>(file.pixels));
  EXPECT_EQ(back->metadata, file.metadata);
}

TEST(ImageIo, KeepsEightAndSixteenBitSamplesInPngAndTiff) {
  for (const ImageFormat format : {ImageFormat::kPng, ImageFormat::kTiff}) {
    for (const int channels : {1, 3, 4}) {
      const std::map<std::string, std::string> text{{"pattern", "region 2,1"}, {"exposure", "3"}};
      expect_same_again<std::uint8_t>({ramp<std::uint8_t>(17, 9, channels), {}, text}, format);
      expect_same_again<std::uint16_t>({ramp<std::uint16_t>(17, 9, channels), {}, text}, format);
    }
  }
}

TEST(ImageIo, KeepsNamedFloatChannelsInExrWhateverTheirOrder) {
  ImageFile file{
      ramp<float>(5, 4, 7), {"R", "G", "B", "var.R", "var.G", "var.B", "mask"}, {{"format", "1"}}};
  std::get<Image<float>>(file.pixels).at(1, 1, 3) = std::numeric_limits<float>::infinity();
  const auto bytes = encode_image(file, ImageFormat::kExr);
  ASSERT_TRUE(bytes) << bytes.error().message;
  const auto back = decode_image(*bytes);
  ASSERT_TRUE(back) << back.error().message;
  const auto all = select_channels(*back, file.channels);
  ASSERT_TRUE(all);
  EXPECT_EQ(*all, std::get<Image<float>>(file.pixels));
  EXPECT_EQ(back->metadata, file.metadata);
  const auto missing = select_channels(*back, std::vector<std::string>{"depth"});
  ASSERT_FALSE(missing);
  EXPECT_THAT(missing.error().message, HasSubstr("\"depth\""));
}

TEST(ImageIo, KeepsNotANumberInExr) {
  Image<float> image(1, 1, 1, std::numeric_limits<float>::quiet_NaN());
  const auto bytes = encode_image({image, {"Y"}, {}}, ImageFormat::kExr);
  ASSERT_TRUE(bytes);
  const auto back = decode_image(*bytes);
  ASSERT_TRUE(back);
  EXPECT_NE(std::get<Image<float>>(back->pixels).at(0, 0),
            std::get<Image<float>>(back->pixels).at(0, 0));
}

TEST(ImageIo, TruncatedFilesAreErrorsAtEveryLength) {
  for (const ImageFormat format : {ImageFormat::kPng, ImageFormat::kTiff, ImageFormat::kExr}) {
    const ImageFile file = format == ImageFormat::kExr
                               ? ImageFile{ramp<float>(33, 20, 3), {}, {}}
                               : ImageFile{ramp<std::uint16_t>(33, 20, 3), {}, {}};
    const auto bytes = encode_image(file, format);
    ASSERT_TRUE(bytes);
    for (const double kept : {0.0, 0.01, 0.2, 0.5, 0.9}) {
      const auto length = static_cast<std::size_t>(kept * static_cast<double>(bytes->size()));
      const auto back = decode_image(std::span(*bytes).first(length));
      ASSERT_FALSE(back) << length << " of " << bytes->size();
      EXPECT_EQ(back.error().code, ErrorCode::kInvalidArgument);
    }
  }
}

TEST(ImageIo, WritesNoDateSoThatEqualImagesGiveEqualBytes) {
  const auto bytes = encode_image({ramp<float>(3, 2, 3), {}, {}}, ImageFormat::kExr);
  ASSERT_TRUE(bytes);
  const std::string_view text(reinterpret_cast<const char*>(bytes->data()), bytes->size());
  EXPECT_THAT(std::string(text), HasSubstr("1970:01:01 00:00:00"));
}

TEST(ImageIo, ForeignFilesAreNamedAsSuch) {
  const std::string_view text = "GIF89a and whatever follows";
  const auto back = decode_image(std::as_bytes(std::span(text)));
  ASSERT_FALSE(back);
  EXPECT_EQ(back.error().message, "not a PNG, TIFF, DNG, EXR or JPEG file");
}

TEST(ImageIo, RefusesWhatIsOverTheLimits) {
  const auto bytes = encode_image({ramp<std::uint16_t>(33, 20, 3), {}, {}}, ImageFormat::kPng);
  ASSERT_TRUE(bytes);
  EXPECT_FALSE(decode_image(*bytes, {.bytes = 100}));
  const auto pixels = decode_image(*bytes, {.pixels = 659});
  ASSERT_FALSE(pixels);
  EXPECT_THAT(pixels.error().message, HasSubstr("33 x 20 pixels"));
  EXPECT_TRUE(decode_image(*bytes, {.pixels = 660}));
  EXPECT_FALSE(decode_image(*bytes, {.channels = 2}));
}

TEST(ImageIo, RefusesWhatAFormatCannotHold) {
  EXPECT_FALSE(encode_image({ramp<float>(2, 2, 3), {}, {}}, ImageFormat::kPng));
  EXPECT_FALSE(encode_image({ramp<std::uint8_t>(2, 2, 3), {}, {}}, ImageFormat::kExr));
  EXPECT_FALSE(encode_image({ramp<std::uint8_t>(2, 2, 5), {}, {}}, ImageFormat::kTiff));
  EXPECT_FALSE(encode_image({ramp<float>(2, 2, 2), {"R", "R"}, {}}, ImageFormat::kExr));
  EXPECT_FALSE(encode_image({Image<float>(), {}, {}}, ImageFormat::kExr));
}

TEST(ImageIo, TellsTheFormatByTheName) {
  EXPECT_EQ(image_format_of("a.b/IMG_1.TIFF").value(), ImageFormat::kTiff);
  EXPECT_EQ(image_format_of("x.exr").value(), ImageFormat::kExr);
  EXPECT_FALSE(image_format_of("x.jpg"));
  EXPECT_FALSE(image_format_of("png"));
}

}  // namespace
}  // namespace opaline
