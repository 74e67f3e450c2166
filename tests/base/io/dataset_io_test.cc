#include "base/io/dataset_io.h"

#include <gmock/gmock.h>

#include <fstream>
#include <limits>
#include <string>

#include "tests/support/temporary_directory.h"

namespace opaline {
namespace {

using ::testing::HasSubstr;

template <class T>
Image<T> raster(int width, int height, int channels, double first) {
  Image<T> image(width, height, channels);
  double value = first;
  for (T& sample : image.samples()) sample = static_cast<T>(value += 0.37);
  return image;
}

// The faces differ in size, so that no raster can be taken for another.
Dataset example() {
  Dataset set;
  set.block = {5, 4, 3, 0.5, 0.25, 0.1};
  set.ior = 1.37;
  set.lit_face = Face::kXMin;
  set.seen_face = Face::kZMax;
  set.view_cosine = raster<float>(5, 4, 1, 0.1);
  set.view_direction = raster<float>(5, 4, 2, 0.2);
  for (const bool held_out : {false, true}) {
    Illumination& light = set.illuminations.emplace_back();
    light.name = held_out ? "held_out_0" : "region_0_0";
    light.held_out = held_out;
    light.calibration_share = held_out ? 0.25 : 0.0;
    light.irradiance = raster<float>(4, 3, 3, held_out ? 2.0 : 1.0);
    light.radiance = raster<float>(5, 4, 3, held_out ? 4.0 : 3.0);
    light.radiance_variance = raster<float>(5, 4, 3, 5.0);
    light.mask = Image<std::uint8_t>(5, 4, 1, 1);
    light.mask.at(2, held_out ? 1 : 3) = 0;
  }
  return set;
}

void expect_equal(const Dataset& a, const Dataset& b) {
  EXPECT_EQ(a.block, b.block);
  EXPECT_EQ(a.ior, b.ior);
  EXPECT_EQ(a.lit_face, b.lit_face);
  EXPECT_EQ(a.seen_face, b.seen_face);
  EXPECT_EQ(a.view_cosine, b.view_cosine);
  EXPECT_EQ(a.view_direction, b.view_direction);
  ASSERT_EQ(a.illuminations.size(), b.illuminations.size());
  for (std::size_t i = 0; i < a.illuminations.size(); ++i) {
    const Illumination& p = a.illuminations[i];
    const Illumination& q = b.illuminations[i];
    EXPECT_EQ(p.name, q.name);
    EXPECT_EQ(p.held_out, q.held_out);
    EXPECT_EQ(p.calibration_share, q.calibration_share);
    EXPECT_EQ(p.irradiance, q.irradiance);
    EXPECT_EQ(p.radiance, q.radiance);
    EXPECT_EQ(p.radiance_variance, q.radiance_variance);
    EXPECT_EQ(p.mask, q.mask);
  }
}

TEST(DatasetFile, ReadsBackExactlyWhatWasWritten) {
  const testing::TemporaryDirectory dir;
  ASSERT_TRUE(write_dataset(system_files(), dir.path(), example()));
  const auto read = read_dataset(dir.path());
  ASSERT_TRUE(read) << read.error().message;
  expect_equal(*read, example());
}

TEST(DatasetFile, KeepsMoreLightsThanAnOrdinaryPictureHasChannels) {
  const testing::TemporaryDirectory dir;
  Dataset set = example();
  for (int i = 0; i < 40; ++i) {
    set.illuminations.push_back(set.illuminations[0]);
    set.illuminations.back().name = "region_" + std::to_string(i) + "_9";
  }
  ASSERT_TRUE(write_dataset(system_files(), dir.path(), set));
  const auto read = read_dataset(dir.path());
  ASSERT_TRUE(read) << read.error().message;
  expect_equal(*read, set);
}

TEST(DatasetFile, WritesTheSameBytesForTheSameDataset) {
  const testing::TemporaryDirectory a;
  const testing::TemporaryDirectory b;
  ASSERT_TRUE(write_dataset(system_files(), a.path(), example()));
  ASSERT_TRUE(write_dataset(system_files(), b.path(), example()));
  for (const char* name : {"dataset.exr", "dataset_light.exr", "dataset.json"}) {
    EXPECT_EQ(*read_bytes(a.path() / name, 1 << 20), *read_bytes(b.path() / name, 1 << 20)) << name;
  }
}

TEST(DatasetFile, RefusesRastersThatDoNotFitTheBlock) {
  const testing::TemporaryDirectory dir;
  Dataset set = example();
  set.illuminations[1].irradiance = raster<float>(5, 4, 3, 0.0);
  const auto written = write_dataset(system_files(), dir.path(), set);
  ASSERT_FALSE(written);
  EXPECT_EQ(written.error().code, ErrorCode::kInvalidArgument);
  EXPECT_THAT(written.error().message, HasSubstr("held_out_0"));
}

TEST(DatasetFile, RefusesANameGivenTwice) {
  const testing::TemporaryDirectory dir;
  Dataset set = example();
  set.illuminations[1].name = set.illuminations[0].name;
  EXPECT_FALSE(write_dataset(system_files(), dir.path(), set));
}

TEST(DatasetFile, SaysThatThereIsNone) {
  const testing::TemporaryDirectory dir;
  const auto read = read_dataset(dir.path());
  ASSERT_FALSE(read);
  EXPECT_EQ(read.error().code, ErrorCode::kNotFound);
}

TEST(DatasetFile, NamesADamagedFile) {
  const testing::TemporaryDirectory dir;
  ASSERT_TRUE(write_dataset(system_files(), dir.path(), example()));
  const auto file = dir.path() / "dataset.exr";
  std::filesystem::resize_file(file, std::filesystem::file_size(file) - 7);
  const auto read = read_dataset(dir.path());
  ASSERT_FALSE(read);
  EXPECT_EQ(read.error().code, ErrorCode::kInvalidArgument);
  EXPECT_THAT(read.error().message, HasSubstr(file.string()));
}

TEST(DatasetFile, RefusesANewerVersion) {
  const testing::TemporaryDirectory dir;
  ASSERT_TRUE(write_dataset(system_files(), dir.path(), example()));
  std::string text = *read_text(dir.path() / "dataset.json");
  text.replace(text.find("\"format\": 3"), 11, "\"format\": 4");
  std::ofstream(dir.path() / "dataset.json") << text;
  const auto read = read_dataset(dir.path());
  ASSERT_FALSE(read);
  EXPECT_THAT(read.error().message, HasSubstr("newer version (format 4"));
}

TEST(DatasetFile, ReadsTheFormatBeforeDirections) {
  const testing::TemporaryDirectory dir;
  Dataset older = example();
  older.view_direction = {};
  ASSERT_TRUE(write_dataset(system_files(), dir.path(), older));
  std::string text = *read_text(dir.path() / "dataset.json");
  text.replace(text.find("\"format\": 3"), 11, "\"format\": 1");
  std::ofstream(dir.path() / "dataset.json") << text;
  const auto read = read_dataset(dir.path());
  ASSERT_TRUE(read) << read.error().message;
  expect_equal(*read, older);
}

TEST(DatasetFile, KeepsTheUniformLightApart) {
  const testing::TemporaryDirectory dir;
  Dataset set = example();
  set.uniform = set.illuminations.front();
  set.uniform->name = "uniform";
  set.uniform->radiance.samples()[0] = 42.0F;
  ASSERT_TRUE(write_dataset(system_files(), dir.path(), set));
  const auto read = read_dataset(dir.path());
  ASSERT_TRUE(read) << read.error().message;
  expect_equal(*read, set);
  ASSERT_TRUE(read->uniform);
  EXPECT_EQ(read->uniform->name, "uniform");
  EXPECT_EQ(read->uniform->radiance, set.uniform->radiance);
  EXPECT_EQ(read->uniform->mask, set.uniform->mask);
  EXPECT_EQ(read->uniform->irradiance, set.uniform->irradiance);
}

TEST(DatasetFile, SurvivesAnySidecar) {
  const testing::TemporaryDirectory dir;
  ASSERT_TRUE(write_dataset(system_files(), dir.path(), example()));
  for (const char* text : {"",
                           "[]",
                           "{",
                           "{\"format\":1}",
                           "{\"format\":\"1\"}",
                           R"({"format":1,"cells":[0,1,1],"spacing_mm":[1,1,1],"ior":1.3,
                               "lit_face":"z_min","seen_face":"z_max","illuminations":[]})",
                           R"({"format":1,"cells":[1,1,1],"spacing_mm":[1,1,1],"ior":1.3,
                               "lit_face":"up","seen_face":"z_max","illuminations":[]})"}) {
    std::ofstream(dir.path() / "dataset.json") << text;
    const auto read = read_dataset(dir.path());
    ASSERT_FALSE(read) << text;
    EXPECT_EQ(read.error().code, ErrorCode::kInvalidArgument) << text;
  }
}

}  // namespace
}  // namespace opaline
