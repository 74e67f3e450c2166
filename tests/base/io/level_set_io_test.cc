#include "base/io/level_set_io.h"

#include <gmock/gmock.h>
#include <openvdb/openvdb.h>
#include <openvdb/tools/LevelSetSphere.h>

#include <cmath>
#include <numbers>

#include "base/files.h"
#include "tests/support/temporary_directory.h"

namespace opaline {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

TEST(LevelSetIo, ReadsTheSurfaceOfASphereOutwardsInWorldUnits) {
  openvdb::initialize();
  const testing::TemporaryDirectory directory;
  const auto path = directory.path() / "ball.vdb";
  openvdb::io::File(path.string())
      .write({openvdb::tools::createLevelSetSphere<openvdb::FloatGrid>(
          5.0F, {1.0F, 2.0F, 3.0F}, 0.25F)});
  const auto surface = read_level_set(path);
  ASSERT_TRUE(surface) << surface.error().message;
  double volume = 0.0;
  for (const auto& t : surface->triangles) {
    const Vec3 a = surface->vertices[t[0]];
    volume += dot(a, cross(surface->vertices[t[1]], surface->vertices[t[2]])) / 6.0;
  }
  // Chords of 0.25 mm lie 0.25^2 / 8 / 5 mm within: 0.1 % of the volume; dual vertices are averages of such cuts.
  EXPECT_NEAR(volume, 4.0 / 3.0 * std::numbers::pi * 125.0, 0.005 * 523.6);
  for (const Vec3& p : surface->vertices) EXPECT_NEAR(length(p - Vec3{1.0, 2.0, 3.0}), 5.0, 0.03);
}

TEST(LevelSetIo, SaysWhatAFileHasInstead) {
  openvdb::initialize();
  const testing::TemporaryDirectory directory;
  const auto fog = openvdb::FloatGrid::create(0.0F);
  fog->setName("density");
  fog->setGridClass(openvdb::GRID_FOG_VOLUME);
  fog->tree().setValue(openvdb::Coord(0, 0, 0), 1.0F);
  const auto path = directory.path() / "fog.vdb";
  openvdb::io::File(path.string()).write({fog});
  EXPECT_THAT(
      read_level_set(path).error().message,
      AllOf(HasSubstr("fog.vdb"), HasSubstr("no level set"), HasSubstr("density (fog volume)")));
  ASSERT_TRUE(
      write_whole(system_files(), directory.path() / "torn.vdb", std::string_view("no vdb")));
  EXPECT_THAT(read_level_set(directory.path() / "torn.vdb").error().message,
              HasSubstr("torn.vdb: no OpenVDB file"));
  EXPECT_EQ(read_level_set(directory.path() / "none.vdb").error().code, ErrorCode::kNotFound);
}

}  // namespace
}  // namespace opaline
