#include "reconstruct/source_choice.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "base/face_view.h"
#include "reconstruct/diffusion/reference_solver.h"
#include "sim/light_transport.h"

namespace opaline::reconstruct {
namespace {

constexpr Block kBlock{12, 12, 16, 1.0, 1.0, 0.5};
constexpr double kRegion = 6.0;  // mm

ChannelCoefficients homogeneous() {
  return {std::vector<double>(kBlock.cell_count(), 0.01),
          std::vector<double>(kBlock.cell_count(), 1.5)};
}

/// Monte Carlo's picture of the face z_max with one region of z_min lit.
Illumination lit_region(double column, double row, bool diffuse) {
  const Vec3 camera = sim::camera_above(kBlock, 300.0, 0.0);
  const sim::LightEntry entry{Face::kZMin, diffuse, column, column + kRegion, row, row + kRegion};
  const auto tally = sim::trace(kBlock,
                                1.3,
                                homogeneous(),
                                entry,
                                {.photons = 150'000,
                                 .seed = 1,
                                 .tally_exitance = false,
                                 .radiance = sim::RadianceTally{Face::kZMax, camera}},
                                {});
  Illumination seen{.name = "region",
                    .irradiance = Image<float>(12, 12, 3),
                    .radiance = Image<float>(12, 12, 3),
                    .radiance_variance = Image<float>(12, 12, 3),
                    .mask = Image<std::uint8_t>(12, 12, 1, 1)};
  for (int y = 0; y < 12; ++y) {
    for (int x = 0; x < 12; ++x) {
      const bool lit = x >= column && x < column + kRegion && y >= row && y < row + kRegion;
      for (int c = 0; c < 3; ++c) {
        seen.irradiance.at(x, y, c) = lit ? 1.0F : 0.0F;
        seen.radiance.at(x, y, c) = static_cast<float>(tally->radiance.mean.at(x, y));
        seen.radiance_variance.at(x, y, c) =
            static_cast<float>(tally->radiance.variance.at(x, y) + 1e-10);
      }
    }
  }
  return seen;
}

Dataset simulated(bool diffuse) {
  Dataset dataset;
  dataset.block = kBlock;
  const FaceView view = view_of_face(kBlock, Face::kZMax, sim::camera_above(kBlock, 300.0, 0.0));
  dataset.view_cosine = view.cosine;
  dataset.view_direction = view.direction;
  for (const bool held_out : {false, true}) {
    for (int n = 0; n < 4; ++n) {
      const double shift = held_out ? 0.5 * kRegion : kRegion;
      const int row = n / 2;
      dataset.illuminations.push_back(lit_region(n % 2 * shift, row * shift, diffuse));
      dataset.illuminations.back().name = fmt::format("light_{}_{}", n, held_out);
      dataset.illuminations.back().held_out = held_out;
    }
  }
  return dataset;
}

SourceChoice choice_for(bool diffuse) {
  const auto solver = diffusion::make_reference_solver();
  const auto choice = choose_source(simulated(diffuse), {.model_error = 0.003}, *solver, {});
  EXPECT_TRUE(choice) << choice.error().message;
  return choice ? *choice : SourceChoice{};
}

// Twelve mean free paths: in a thinner sample a homogeneous one of other coefficients explains a beam with either source.
TEST(SourceChoice, IsCollimatedForABeam) {
  const SourceChoice choice = choice_for(false);
  EXPECT_EQ(choice.model, diffusion::SourceModel::kCollimated) << choice.why;
  EXPECT_LT(choice.collimated, choice.surface);
  EXPECT_NE(choice.why.find("more than its standard error"), std::string::npos) << choice.why;
}

TEST(SourceChoice, IsTheSurfaceForDiffuseLight) {
  const SourceChoice choice = choice_for(true);
  EXPECT_EQ(choice.model, diffusion::SourceModel::kSurface) << choice.why;
}

}  // namespace
}  // namespace opaline::reconstruct
