#include "base/io/volume_io.h"

#include <gmock/gmock.h>

#include <array>
#include <cstdio>
#include <string>

#include "tests/support/temporary_directory.h"

namespace opaline {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

/// Distinct values in every cell and channel, all of them exact in float32.
Material make_material() {
  Material material;
  material.block = {5, 4, 3, 0.5, 0.25, 2.0};
  material.ior = 1.3;
  material.name = "a block";
  for (int c = 0; c < kColorChannels; ++c) {
    for (std::size_t i = 0; i < material.block.cell_count(); ++i) {
      const double value = static_cast<double>(i + 1) / 64.0 + c;
      material.channels[c].absorption.push_back(value / 128.0);
      material.channels[c].reduced_scattering.push_back(value);
    }
  }
  return material;
}

MaterialUncertainty make_uncertainty(const Block& block) {
  MaterialUncertainty channels;
  for (std::size_t c = 0; c < channels.size(); ++c) {
    for (std::size_t i = 0; i < block.cell_count(); ++i) {
      const double value = static_cast<double>(i + 1) / 256.0;
      const auto shifted = [&](int by) {
        return value + static_cast<double>(by) + static_cast<double>(c);
      };
      channels[c].deviation.absorption.push_back(shifted(0));
      channels[c].deviation.reduced_scattering.push_back(shifted(3));
      channels[c].deviation.diffusion.push_back(shifted(6));
      channels[c].shift.absorption.push_back(shifted(-3));
      channels[c].shift.reduced_scattering.push_back(shifted(-6));
      channels[c].shift.diffusion.push_back(shifted(-9));
    }
  }
  return channels;
}

std::string output_of(const std::string& command) {
  std::string text;
  FILE* pipe = ::popen(command.c_str(), "r");
  std::array<char, 4096> buffer{};
  while (std::size_t n = std::fread(buffer.data(), 1, buffer.size(), pipe)) {
    text.append(buffer.data(), n);
  }
  EXPECT_EQ(::pclose(pipe), 0) << command;
  return text;
}

TEST(VolumeIo, ReadsBackWhatItWrote) {
  const testing::TemporaryDirectory directory;
  const auto path = directory.path() / "material.vdb";
  ASSERT_TRUE(write_material(system_files(), path, make_material(), "test"));
  const auto read = read_material(path);
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(*read, make_material());
}

TEST(VolumeIo, KeepsTheUncertaintyBesideTheCoefficients) {
  const testing::TemporaryDirectory directory;
  const auto path = directory.path() / "material.vdb";
  const Material material = make_material();
  const MaterialUncertainty uncertainty = make_uncertainty(material.block);
  ASSERT_TRUE(write_material(system_files(), path, material, "test", &uncertainty));
  const auto read = read_uncertainty(path);
  ASSERT_TRUE(read) << read.error().message;
  ASSERT_TRUE(read->has_value());
  EXPECT_EQ(**read, uncertainty);
  EXPECT_EQ(read_material(path).value(), material);
  EXPECT_THAT(
      output_of("vdb_print -l " + path.string() + " 2>&1"),
      AllOf(HasSubstr("Name: reduced_scattering_log_sd"), HasSubstr("Name: diffusion_log_shift")));
}

TEST(VolumeIo, SaysWhenThereIsNoUncertainty) {
  const testing::TemporaryDirectory directory;
  const auto path = directory.path() / "material.vdb";
  ASSERT_TRUE(write_material(system_files(), path, make_material(), "test"));
  const auto read = read_uncertainty(path);
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_FALSE(read->has_value());
}

TEST(VolumeIo, RefusesAnUncertaintyThatDoesNotFitTheBlock) {
  const Material material = make_material();
  MaterialUncertainty uncertainty = make_uncertainty(material.block);
  uncertainty[1].deviation.diffusion.pop_back();
  const auto encoded = encode_material(material, "test", &uncertainty);
  ASSERT_FALSE(encoded);
  EXPECT_THAT(encoded.error().message,
              HasSubstr("channel green, diffusion_log_sd has 59 values for 60 cells"));
}

TEST(VolumeIo, IsUnderstoodByOpenVdbsOwnProgram) {
  const testing::TemporaryDirectory directory;
  const auto path = directory.path() / "material.vdb";
  ASSERT_TRUE(write_material(system_files(), path, make_material(), "test 1.2"));
  const std::string text = output_of("vdb_print -l " + path.string() + " 2>&1");
  for (const char* name : {"absorption", "reduced_scattering", "diffusion"}) {
    EXPECT_THAT(text, HasSubstr(std::string("Name: ") + name));
  }
  EXPECT_THAT(text,
              AllOf(HasSubstr("vec3s"), HasSubstr("5 x 4 x 3"), HasSubstr("voxels:       60")));
  EXPECT_THAT(text, AllOf(HasSubstr("opaline_ior: 1.3"), HasSubstr("creator: test 1.2")));
  // Cell (0, 0, 0) has its centre half a cell from the corner.
  EXPECT_THAT(text, HasSubstr("voxel dimensions: [0.5, 0.25, 2]"));
  EXPECT_THAT(text, HasSubstr("[0.25, 0.125, 1, 1]"));  // the row that moves
}

TEST(VolumeIo, SaysSoWhenAFileIsTruncatedAtAnyLength) {
  const auto whole = encode_material(make_material(), "test");
  ASSERT_TRUE(whole);
  for (std::size_t length = 8; length < whole->size(); length += 97) {
    const auto read = decode_material(std::string_view(*whole).substr(0, length));
    ASSERT_FALSE(read) << length;
    EXPECT_EQ(read.error().code, ErrorCode::kInvalidArgument);
    EXPECT_THAT(read.error().message, HasSubstr("truncated")) << length;
  }
}

TEST(VolumeIo, RefusesAForeignFileByName) {
  const testing::TemporaryDirectory directory;
  const auto path = directory.path() / "material.vdb";
  ASSERT_TRUE(write_whole(system_files(), path, "this is a text, and no volume"));
  const auto read = read_material(path);
  ASSERT_FALSE(read);
  EXPECT_THAT(read.error().message,
              AllOf(HasSubstr(path.string()), HasSubstr("not an OpenVDB file")));
}

TEST(VolumeIo, RefusesANewerFormat) {
  auto bytes = encode_material(make_material(), "test").value();
  // Int32 metadata: name, length-prefixed type "int32", size 4, value.
  const std::size_t name = bytes.find("opaline_format");
  const std::size_t type = bytes.find("int32", name);
  ASSERT_NE(type, std::string::npos);
  bytes[type + 5 + 4] = 2;
  const auto read = decode_material(bytes);
  ASSERT_FALSE(read);
  EXPECT_THAT(read.error().message, HasSubstr("newer version (format 2"));
}

TEST(VolumeIo, RefusesFieldsThatDoNotFitTheBlock) {
  Material material = make_material();
  material.channels[1].absorption.pop_back();
  const auto bytes = encode_material(material, "test");
  ASSERT_FALSE(bytes);
  EXPECT_THAT(bytes.error().message, HasSubstr("channel green has 59 and 60 values for 60 cells"));
}

}  // namespace
}  // namespace opaline
