#include "reconstruct/surface_reflectance.h"

#include <gtest/gtest.h>

#include "base/face_view.h"
#include "reconstruct/diffusion/reference_solver.h"
#include "sim/light_transport.h"

namespace opaline::reconstruct {
namespace {

constexpr Block kBlock{12, 12, 10, 1.0, 1.0, 0.5};
constexpr Block kFine{12, 12, 40, 1.0, 1.0, 0.125};
constexpr double kReflectance = 0.1;

Material homogeneous(const Block& block = kBlock) {
  Material material{block, 1.3, {}, "homogeneous"};
  for (auto& channel : material.channels) {
    channel.reduced_scattering.assign(block.cell_count(), 2.0);
    channel.absorption.assign(block.cell_count(), 0.01);
  }
  return material;
}

Vec3 camera_of(const Block& block) { return sim::camera_above(block, 300.0, 20.0); }

/// Monte Carlo's picture of the face z_max under light all over it, and a surface that reflects a tenth.
Illumination seen_all_lit(const Material& material) {
  const Block& block = material.block;
  const auto tally = sim::trace(block,
                                material.ior,
                                material.channels[0],
                                sim::whole_face(block, Face::kZMax),
                                {.photons = 200'000,
                                 .seed = 1,
                                 .tally_exitance = false,
                                 .radiance = sim::RadianceTally{Face::kZMax, camera_of(block)}},
                                {});
  Illumination seen{.name = "uniform",
                    .irradiance = Image<float>(12, 12, 3, 1.0F),
                    .radiance = Image<float>(12, 12, 3),
                    .radiance_variance = Image<float>(12, 12, 3, 1e-6F),
                    .mask = Image<std::uint8_t>(12, 12, 1, 1)};
  for (int y = 0; y < 12; ++y)
    for (int x = 0; x < 12; ++x)
      for (int c = 0; c < 3; ++c)
        seen.radiance.at(x, y, c) =
            static_cast<float>(tally->radiance.mean.at(x, y) + kReflectance);
  return seen;
}

Dataset simulated(const Material& material) {
  const Block& block = material.block;
  Dataset dataset;
  dataset.block = block;
  dataset.lit_face = dataset.seen_face = Face::kZMax;
  const FaceView view = view_of_face(block, Face::kZMax, camera_of(block));
  dataset.view_cosine = view.cosine;
  dataset.view_direction = view.direction;
  dataset.uniform = seen_all_lit(material);
  dataset.uniform->mask.at(5, 5) = 0;
  return dataset;
}

/// The mean over the middle 36 cells but the masked one.
double found_reflectance(const Dataset& dataset, const Material& material) {
  const auto solver = diffusion::make_reference_solver();
  const auto surface = surface_reflectance(dataset, material, {}, *solver, {});
  if (!surface || !surface->has_value()) return -1.0;
  EXPECT_EQ((*surface)->reflectance.at(5, 5, 1), 0.0F);
  double sum = 0.0;
  int count = 0;
  for (int y = 3; y < 9; ++y) {
    for (int x = 3; x < 9; ++x) {
      if ((*surface)->mask.at(x, y) == 0) continue;
      sum += (*surface)->reflectance.at(x, y, 1);
      ++count;
    }
  }
  EXPECT_EQ(count, 35);
  return sum / count;
}

// Diffusion's reflection is within 2.5 % of transport's (docs/physics.md, "How light enters") and the radiance is 2.15 times
// rho_s here, so 5.4 % of it; the Monte Carlo's own noise over the middle 36 cells is 0.3 % of the radiance. Light seen by
// diffusion alone would make rho_s 15 to 24 % too large, and more so on the fine grid.
TEST(SurfaceReflectanceMap, IsWhatTheMaterialDoesNotExplainUnderUniformLight) {
  for (const Block& block : {kBlock, kFine}) {
    const Material material = homogeneous(block);
    EXPECT_NEAR(
        found_reflectance(simulated(material), material), kReflectance, 0.054 * kReflectance)
        << block.nz << " layers";
  }
}

TEST(SurfaceReflectanceMap, IsNoneWithoutAPictureUnderUniformLight) {
  const Material material = homogeneous();
  Dataset dataset = simulated(material);
  dataset.uniform.reset();
  const auto solver = diffusion::make_reference_solver();
  const auto surface = surface_reflectance(dataset, material, {}, *solver, {});
  ASSERT_TRUE(surface);
  EXPECT_FALSE(surface->has_value());
}

}  // namespace
}  // namespace opaline::reconstruct
