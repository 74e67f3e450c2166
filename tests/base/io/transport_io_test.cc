#include "base/io/transport_io.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>

namespace opaline {
namespace {

using testing::HasSubstr;

TransportResponses example() {
  TransportResponses responses{.block = {5, 3, 2, 0.5, 0.25, 1.0},
                               .ior = 1.4,
                               .lit_face = Face::kZMax,
                               .seen_face = Face::kZMax,
                               .diffuse_entry = true,
                               .patches_x = 2,
                               .patches_y = 1,
                               .camera_centre = {1.0 / 3.0, -2.0, 300.0},
                               .anisotropy = 0.7,
                               .seed = 0xfedcba9876543210U,
                               .photons_per_patch = 4096,
                               .generator = "test",
                               .scene = R"({"kind":"wax \" 1"})",
                               .patches = {}};
  for (int p = 0; p < 2; ++p) {
    PatchResponse patch{Image<float>(5, 3, 3), Image<float>(5, 3, 3)};
    for (std::size_t i = 1; i < patch.radiance.samples().size(); ++i) {
      patch.radiance.samples()[i] =
          std::pow(0.7F, static_cast<float>(i)) * static_cast<float>(p + 1);
      patch.variance.samples()[i] = std::pow(0.1F, static_cast<float>(i % 30));
    }
    responses.patches.push_back(patch);
  }
  return responses;
}

TEST(TransportIo, GivesBackWhatWasWritten) {
  const TransportResponses written = example();
  const std::filesystem::path path =
      std::filesystem::path(testing::TempDir()) / "responses.transport";
  ASSERT_TRUE(write_transport(system_files(), path, written));
  auto read = read_transport(path);
  ASSERT_TRUE(read) << read.error().message;
  for (std::size_t p = 0; p < 2; ++p) {
    for (std::size_t i = 0; i < written.patches[p].variance.samples().size(); ++i) {
      const float expected = written.patches[p].variance.samples()[i];
      EXPECT_NEAR(
          read->patches[p].variance.samples()[i], expected, 0.0015F * expected);  // half a code
    }
    read->patches[p].variance = written.patches[p].variance;
  }
  EXPECT_EQ(*read, written);
}

TEST(TransportIo, RefusesEveryCutAndEveryDamagedByte) {
  const auto bytes = encode_transport(example());
  ASSERT_TRUE(bytes);
  for (std::size_t length = 0; length < bytes->size(); ++length) {
    EXPECT_FALSE(decode_transport(std::span(*bytes).first(length))) << length;
  }
  for (std::size_t i = 0; i < bytes->size(); ++i) {
    std::vector<std::byte> damaged = *bytes;
    damaged[i] ^= std::byte{0x10};
    EXPECT_FALSE(decode_transport(damaged)) << i;
  }
}

TEST(TransportIo, NamesAVersionItCannotRead) {
  auto bytes = encode_transport(example());
  ASSERT_TRUE(bytes);
  (*bytes)[18] = std::byte{'2'};
  const auto read = decode_transport(*bytes);
  ASSERT_FALSE(read);
  EXPECT_THAT(read.error().message, HasSubstr("another version"));
}

TEST(TransportIo, RefusesToWritePicturesThatAreMissing) {
  TransportResponses responses = example();
  responses.patches.pop_back();
  EXPECT_FALSE(encode_transport(responses));
}

TEST(TransportIo, RefusesWhatNoRunCanHaveWritten) {
  const auto refused = [](auto change) {
    TransportResponses responses = example();
    change(responses);
    const auto bytes = encode_transport(responses);
    return bytes && !decode_transport(*bytes);
  };
  EXPECT_FALSE(refused([](TransportResponses&) {}));
  EXPECT_TRUE(refused([](TransportResponses& r) { r.passes = 0; }));
  EXPECT_TRUE(refused([](TransportResponses& r) { r.block.hx = 1e300; }));
  EXPECT_TRUE(refused([](TransportResponses& r) { r.ior = 0.5; }));
  EXPECT_TRUE(refused([](TransportResponses& r) { r.anisotropy = 1.0; }));
  EXPECT_TRUE(refused([](TransportResponses& r) { r.camera_centre.x = 1e300; }));
}

TEST(TransportIo, SaysThatAFileIsNotThere) {
  const auto read = read_transport(std::filesystem::path(testing::TempDir()) / "no.transport");
  ASSERT_FALSE(read);
  EXPECT_EQ(read.error().code, ErrorCode::kNotFound);
}

}  // namespace
}  // namespace opaline
