#include "base/io/surface_io.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/temporary_directory.h"

namespace opaline {
namespace {

SurfaceReflectance some_surface() {
  SurfaceReflectance s{{5, 4, 3, 0.5, 0.25, 1.0}, Face::kYMin, {}, {}, {}};
  s.reflectance = Image<float>(5, 3, 3);
  s.variance = Image<float>(5, 3, 3);
  s.mask = Image<std::uint8_t>(5, 3, 1, 1);
  s.mask.at(4, 2) = 0;
  for (std::size_t i = 0; i < s.reflectance.samples().size(); ++i) {
    s.reflectance.samples()[i] = 0.01F * static_cast<float>(i) - 0.02F;
    s.variance.samples()[i] = 1e-6F * static_cast<float>(i + 1);
  }
  return s;
}

TEST(SurfaceFile, ReadsBackWhatWasWritten) {
  const testing::TemporaryDirectory dir;
  const auto path = dir.path() / "surface.exr";
  const SurfaceReflectance s = some_surface();
  ASSERT_TRUE(write_surface(system_files(), path, s));
  const auto again = read_surface(path);
  ASSERT_TRUE(again) << again.error().message;
  EXPECT_EQ(again->block, s.block);
  EXPECT_EQ(again->face, s.face);
  EXPECT_EQ(again->reflectance, s.reflectance);
  EXPECT_EQ(again->variance, s.variance);
  EXPECT_EQ(again->mask, s.mask);
}

TEST(SurfaceFile, RefusesRastersThatDoNotCoverTheFace) {
  const testing::TemporaryDirectory dir;
  SurfaceReflectance s = some_surface();
  s.face = Face::kZMax;
  const auto written = write_surface(system_files(), dir.path() / "surface.exr", s);
  ASSERT_FALSE(written);
  EXPECT_EQ(written.error().code, ErrorCode::kInvalidArgument);
}

TEST(SurfaceFile, SaysWhatIsMissingAndWhatIsDamaged) {
  const testing::TemporaryDirectory dir;
  const auto path = dir.path() / "surface.exr";
  EXPECT_EQ(read_surface(path).error().code, ErrorCode::kNotFound);
  ASSERT_TRUE(write_whole(system_files(), path, std::string("no picture")));
  const auto damaged = read_surface(path);
  ASSERT_FALSE(damaged);
  EXPECT_THAT(damaged.error().message, ::testing::HasSubstr("surface.exr"));
}

}  // namespace
}  // namespace opaline
