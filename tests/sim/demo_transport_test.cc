#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdlib>
#include <filesystem>

#include "base/io/transport_io.h"
#include "sim/light_transport.h"
#include "sim/photon_lanes.h"
#include "sim/scene.h"

// The committed responses of the demo's sample against the code as it is now.

namespace opaline::sim {
namespace {

std::filesystem::path demo_file() {
  return std::filesystem::path(std::getenv("OPALINE_SOURCE_DIR")) /
         "sim/data/demo_marble.transport";
}

ResponseOptions options_of(const TransportResponses& responses) {
  return {.lit_face = responses.lit_face,
          .seen_face = responses.seen_face,
          .diffuse_entry = responses.diffuse_entry,
          .patches_x = responses.patches_x,
          .patches_y = responses.patches_y,
          .camera_centre = responses.camera_centre,
          .anisotropy = responses.anisotropy,
          .seed = responses.seed};
}

/// Means over squares of 4 x 4 cells: so many photons that they are normally distributed.
struct Squares {
  std::vector<double> mean;
  std::vector<double> variance;
};
Squares squares_of(const PatchResponse& patch, int channel) {
  Squares squares;
  for (int y = 0; y < patch.radiance.height(); y += 4) {
    for (int x = 0; x < patch.radiance.width(); x += 4) {
      double mean = 0.0;
      double variance = 0.0;
      for (int i = 0; i < 16; ++i) {
        mean += patch.radiance.at(x + i % 4, y + i / 4, channel);
        variance += patch.variance.at(x + i % 4, y + i / 4, channel);
      }
      squares.mean.push_back(mean / 16);
      squares.variance.push_back(variance / 256);
    }
  }
  return squares;
}

TEST(DemoTransport, IsTheDemosSampleLitFromBehindInEightByEightPatches) {
  ASSERT_LE(std::filesystem::file_size(demo_file()), 4u << 20);
  const auto demo = read_transport(demo_file());
  ASSERT_TRUE(demo) << demo.error().message;
  const auto scene = scene_from_json(demo->scene);
  ASSERT_TRUE(scene);
  EXPECT_EQ(*scene, SceneOptions{});
  EXPECT_EQ(demo->block, scene->block);
  EXPECT_EQ(demo->lit_face, Face::kZMin);
  EXPECT_EQ(demo->seen_face, Face::kZMax);
  EXPECT_EQ(demo->patches_x, 8);
  EXPECT_EQ(demo->patches_y, 8);
  EXPECT_LT(length(demo->camera_centre - camera_above(demo->block, 300.0, 10.0)), 1e-9);
}

TEST(DemoTransport, OnePatchComputedAfreshIsTheSameWithinNoise) {
  const auto demo = read_transport(demo_file());
  ASSERT_TRUE(demo);
  const auto material = make_material(*scene_from_json(demo->scene));
  SplitMix random(20261122);
  const int column = static_cast<int>(random.next() % 8);
  const int row = static_cast<int>(random.next() % 8);
  ResponseOptions options = options_of(*demo);
  options.photons_per_patch = 1 << 17;
  options.seed = demo->seed + 1'000'000;  // of none of its passes
  const auto fresh = patch_response(*material, options, column, row, {});
  ASSERT_TRUE(fresh);
  double chi_squared = 0.0;
  double light = 0.0;
  double fresh_light = 0.0;
  int count = 0;
  for (int channel = 0; channel < kColorChannels; ++channel) {
    const Squares old_squares = squares_of(demo->patch(column, row), channel);
    const Squares new_squares = squares_of(*fresh, channel);
    for (std::size_t i = 0; i < old_squares.mean.size(); ++i, ++count) {
      const double difference = old_squares.mean[i] - new_squares.mean[i];
      chi_squared += difference * difference / (old_squares.variance[i] + new_squares.variance[i]);
      light += old_squares.mean[i];
      fresh_light += new_squares.mean[i];
    }
  }
  // 432 squares: a standard deviation of sqrt(2/432) = 0.07; photons seen in several cells of a square raise chi^2.
  EXPECT_GT(chi_squared / count, 0.7);
  EXPECT_LT(chi_squared / count, 1.6);
  EXPECT_NEAR(fresh_light / light, 1.0, 0.03);
}

TEST(DemoTransport, RegionsOfFourPatchesAreKnownToWithinAPercentWhereBright) {
  const auto demo = read_transport(demo_file());
  ASSERT_TRUE(demo);
  for (int region = 0; region < 16; ++region) {
    const std::array<const PatchResponse*, 4> patches{
        &demo->patch(region % 4 * 2, region / 4 * 2),
        &demo->patch(region % 4 * 2 + 1, region / 4 * 2),
        &demo->patch(region % 4 * 2, region / 4 * 2 + 1),
        &demo->patch(region % 4 * 2 + 1, region / 4 * 2 + 1)};
    double light = 0.0;
    double noise = 0.0;
    for (std::size_t i = 0; i < patches[0]->radiance.samples().size(); ++i) {
      double radiance = 0.0;
      double variance = 0.0;
      for (const PatchResponse* patch : patches) {
        radiance += patch->radiance.samples()[i];
        variance += patch->variance.samples()[i];
      }
      light += radiance * radiance;
      noise += variance;
    }
    EXPECT_LT(std::sqrt(noise / light), 0.01) << "region " << region;
  }
}

}  // namespace
}  // namespace opaline::sim
