#include "daemon/scattering/sphere_shell.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdio>
#include <map>
#include <string>

#include "base/io/volume_io.h"
#include "daemon/scattering/start_material.h"
#include "tests/support/ball_maps.h"
#include "tests/support/temporary_directory.h"

namespace opaline::daemon {
namespace {

using support::ball_maps;
using support::ball_session;
using support::kPixelMm;
using support::kPixels;
using support::kRadius;
using support::kSeen;

// z = R (sqrt(1 - rho^2) - sqrt(1 - 0.9^2)) over the outline's plane; the trapezoids of the slopes err most at the steep outline, by a few hundredths of R.
TEST(SphereShell, AddsUpTheNormalsOfABallToABall) {
  const SphereMaps maps = ball_maps(false);
  const Relief r = relief_of(maps, ball_session(maps));
  ASSERT_EQ(r.step, 1);
  const double outline = std::sqrt(1.0 - kSeen * kSeen);
  for (const int x : {48, 60, 72, 80}) {
    const double rho = (x + 0.5 - 48.0) * kPixelMm / kRadius;
    EXPECT_NEAR(r.at(x, 48), kRadius * (std::sqrt(1.0 - rho * rho) - outline), 0.03 * kRadius) << x;
  }
  EXPECT_FALSE(r.has(0, 0));
}

TEST(SphereShell, FillsTheVolumeFromTheMapsAndHolesFromTheirNearest) {
  const SphereMaps maps = ball_maps(true);
  const SphereSession session = ball_session(maps);
  const Relief relief = relief_of(maps, session);
  const auto shell = shell_of(maps, session, relief, 1.4, "ball");
  ASSERT_TRUE(shell) << shell.error().message;
  EXPECT_EQ(shell->ior, 1.4);
  for (const double value : shell->channels[2].reduced_scattering) ASSERT_NEAR(value, 1.6, 1e-6);
  for (const double value : shell->channels[0].absorption) ASSERT_NEAR(value, 0.08, 1e-6);
  const auto filled = nearest_maps(relief, maps.channels[0]);
  ASSERT_TRUE(filled);
  EXPECT_EQ(filled->diffusion[48 * kPixels + 10], 0.2F);
}

TEST(SphereShell, HasAClosedMeshWithCoordinates) {
  const SphereMaps maps = ball_maps(false);
  const std::string text = relief_obj(relief_of(maps, ball_session(maps)));
  std::map<std::pair<int, int>, int> edges;  // each once in either direction
  int faces = 0;
  for (std::size_t at = text.find("\nf "); at != std::string::npos;
       at = text.find("\nf ", at + 1)) {
    std::array<int, 6> n{};
    ASSERT_EQ(
        std::sscanf(
            text.c_str() + at, "\nf %d/%d %d/%d %d/%d", &n[0], &n[1], &n[2], &n[3], &n[4], &n[5]),
        6);
    for (const auto& [a, b] : {std::pair{n[0], n[2]}, {n[2], n[4]}, {n[4], n[0]}}) ++edges[{a, b}];
    ++faces;
  }
  EXPECT_GT(faces, 10'000);
  for (const auto& [edge, times] : edges) {
    ASSERT_EQ(times, 1);
    ASSERT_TRUE(edges.contains({edge.second, edge.first}));
  }
}

TEST(SphereShell, NoAnswerAnywhereIsSaid) {
  SphereMaps maps = ball_maps(false);
  for (auto& reason : maps.channels[1].left_out) reason = reconstruct::LeftOut::kBelowNoise;
  const SphereSession session = ball_session(maps);
  const auto shell = shell_of(maps, session, relief_of(maps, session), 1.4, "ball");
  ASSERT_FALSE(shell);
  EXPECT_EQ(shell.error().message,
            "green: no pixel has an answer, so there is no material to make a volume of");
}

TEST(StartMaterial, IsTheMedianOfMapsOrTheMeanOfAVolume) {
  const testing::TemporaryDirectory directory;
  const SphereMaps maps = ball_maps(false);
  const SphereSession session = ball_session(maps);
  const auto shell = shell_of(maps, session, relief_of(maps, session), 1.4, "ball");
  ASSERT_TRUE(shell);
  const auto path = directory.path() / "material.vdb";
  ASSERT_TRUE(write_material(system_files(), path, *shell, "test"));
  const auto start = read_start(path);
  ASSERT_TRUE(start) << start.error().message;
  EXPECT_NEAR((*start)[0].reduced_scattering, 1.6, 1e-4);
  EXPECT_NEAR((*start)[0].absorption, 0.08, 1e-5);
  const auto none = read_start(directory.path() / "maps.exr");
  ASSERT_FALSE(none);
  EXPECT_EQ(none.error().code, ErrorCode::kNotFound);
}

}  // namespace
}  // namespace opaline::daemon
