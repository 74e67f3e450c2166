#include "reconstruct/regrid.h"

#include <gmock/gmock.h>

#include <cmath>

namespace opaline::reconstruct {
namespace {

using ::testing::ElementsAre;

constexpr double kFloat = 1e-6;  // pictures are 32-bit

Illumination light(const Block& block, const std::string& name, int left, int right) {
  Illumination i{.name = name,
                 .held_out = false,
                 .irradiance = Image<float>(block.nx, block.ny, kColorChannels),
                 .radiance = Image<float>(block.nx, block.ny, kColorChannels),
                 .radiance_variance = Image<float>(block.nx, block.ny, kColorChannels, 0.04F),
                 .mask = Image<std::uint8_t>(block.nx, block.ny, 1, 1)};
  for (int y = 0; y < block.ny; ++y)
    for (int x = 0; x < block.nx; ++x)
      for (int c = 0; c < kColorChannels; ++c) {
        i.irradiance.at(x, y, c) = x >= left && x < right ? 1.0F : 0.0F;
        i.radiance.at(x, y, c) = static_cast<float>(1 + x + 10 * y + 100 * c);
      }
  return i;
}

Dataset four_columns() {
  Dataset d;
  d.block = {8, 4, 4, 1.0, 2.0, 0.5};
  d.view_cosine = Image<float>(8, 4, 1, 0.9F);
  for (int k = 0; k < 4; ++k)
    d.illuminations.push_back(light(d.block, "region_" + std::to_string(k), 2 * k, 2 * k + 2));
  d.illuminations.push_back(light(d.block, "held_out_0", 1, 3));
  d.illuminations.back().held_out = true;
  return d;
}

double total(const Image<float>& image) {
  double sum = 0.0;
  for (const float v : image.samples()) sum += v;
  return sum;
}

TEST(Regrid, KeepsTheBoxWhateverTheStep) {
  const Block block{13, 48, 5, 0.5, 0.25, 2.0};
  for (const double step : {1.0, 1.5, 2.0, 4.0, 100.0}) {
    const Block coarse = coarser(block, step);
    EXPECT_NEAR(coarse.size().x, block.size().x, 1e-12);
    EXPECT_NEAR(coarse.size().y, block.size().y, 1e-12);
    EXPECT_NEAR(coarse.size().z, block.size().z, 1e-12);
  }
  EXPECT_THAT(coarser(block, 2.0).cells(), ElementsAre(7, 24, 3));
  EXPECT_THAT(coarser(block, 100.0).cells(), ElementsAre(1, 1, 1));
  EXPECT_EQ(coarser(block, 1.0), block);
}

// Light and pictures are densities over the face: their integral stays, also where cells do not divide.
TEST(Regrid, KeepsTheLightAndWhatIsSeenOfIt) {
  const Dataset fine = four_columns();
  for (const double step : {2.0, 1.6, 3.0}) {
    const Dataset coarse = on_grid(fine, coarser(fine.block, step));
    const double area =
        static_cast<double>(fine.block.nx * fine.block.ny) / (coarse.block.nx * coarse.block.ny);
    for (std::size_t m = 0; m < fine.illuminations.size(); ++m) {
      const double before = total(fine.illuminations[m].irradiance);
      EXPECT_NEAR(area * total(coarse.illuminations[m].irradiance), before, kFloat * before)
          << step;
      const double seen = total(fine.illuminations[m].radiance);
      EXPECT_NEAR(area * total(coarse.illuminations[m].radiance), seen, kFloat * seen) << step;
    }
  }
}

TEST(Regrid, AveragesTheUsablePartAndItsNoise) {
  Dataset fine = four_columns();
  Illumination& i = fine.illuminations.front();
  i.mask.at(0, 0) = 0;
  i.radiance.at(0, 0, 0) = 1e6F;  // a saturated cell
  i.mask.at(2, 0) = i.mask.at(3, 0) = i.mask.at(2, 1) = 0;
  const Illumination coarse = on_grid(fine, coarser(fine.block, 2.0)).illuminations.front();
  EXPECT_EQ(coarse.mask.at(0, 0), 1);
  EXPECT_NEAR(coarse.radiance.at(0, 0, 0), (2.0 + 11.0 + 12.0) / 3.0, 1e-5);
  EXPECT_NEAR(coarse.radiance_variance.at(0, 0, 0), 0.04 / 3.0, 1e-7);
  EXPECT_NEAR(coarse.radiance_variance.at(3, 1, 0), 0.04 / 4.0, 1e-7);
  EXPECT_EQ(coarse.mask.at(1, 0), 0);  // three of four cells are of no use
}

TEST(Regrid, AddsRegionsAndTheirVariances) {
  const auto merged = with_regions(four_columns(), 1);
  ASSERT_TRUE(merged);
  ASSERT_EQ(merged->illuminations.size(), 2u);
  const Illumination& all = merged->illuminations.front();
  EXPECT_FALSE(all.held_out);
  EXPECT_THAT(all.irradiance.samples(), ::testing::Each(1.0F));
  EXPECT_NEAR(all.radiance.at(3, 2, 1), 4.0 * (1 + 3 + 20 + 100), 1e-3);
  EXPECT_NEAR(all.radiance_variance.at(3, 2, 1), 0.16, kFloat);
  EXPECT_EQ(merged->illuminations.back().name, "held_out_0");
}

TEST(Regrid, PutsNeighboursTogether) {
  Dataset dataset = four_columns();
  std::ranges::fill(dataset.illuminations[1].mask.samples(), std::uint8_t{0});
  // A fifth region, so that there are more than 2 x 2.
  dataset.illuminations.push_back(light(dataset.block, "region_4", 0, 1));
  const auto merged = with_regions(dataset, 2);
  ASSERT_TRUE(merged);
  ASSERT_EQ(merged->illuminations.size(), 3u);  // left, right, held out
  const Illumination& left = merged->illuminations[0];
  EXPECT_EQ(left.irradiance.at(3, 0), 0.0F);  // a region that nobody saw counts neither here
  EXPECT_EQ(left.mask.at(0, 0), 1);           // nor there
  EXPECT_EQ(left.irradiance.at(0, 0), 2.0F);
  const Illumination& right = merged->illuminations[1];
  EXPECT_EQ(right.irradiance.at(3, 0), 0.0F);
  EXPECT_EQ(right.irradiance.at(4, 0), 1.0F);
  EXPECT_EQ(right.irradiance.at(7, 0), 1.0F);
}

TEST(Regrid, LeavesFewEnoughRegionsAsTheyAre) {
  const Dataset dataset = four_columns();
  const auto same = with_regions(dataset, 2);
  ASSERT_TRUE(same);
  EXPECT_EQ(same->illuminations.size(), dataset.illuminations.size());
  EXPECT_FALSE(with_regions(dataset, 0));
}

Material material(const Block& block, double slope) {
  Material m;
  m.block = block;
  for (ChannelCoefficients& c : m.channels)
    for (int k = 0; k < block.nz; ++k)
      for (int j = 0; j < block.ny; ++j)
        for (int i = 0; i < block.nx; ++i) {
          c.reduced_scattering.push_back(
              std::exp(slope * ((i + 0.5) * block.hx - 2.0 * (k + 0.5) * block.hz)));
          c.absorption.push_back(0.0);
        }
  return m;
}

// Exponentials are straight lines in the logarithm: exact between the outermost centres, and held beyond them.
TEST(Regrid, InterpolatesCoefficientsInTheLogarithm) {
  const Block coarse{4, 3, 2, 2.0, 2.0, 2.0};
  const Block fine{8, 6, 4, 1.0, 1.0, 1.0};
  const Material found = on_grid(material(coarse, 0.3), fine);
  const Material truth = material(fine, 0.3);
  for (int i = 1; i < 7; ++i) {
    const std::size_t cell = fine.index(i, 2, 1);
    EXPECT_NEAR(found.channels[0].reduced_scattering[cell],
                truth.channels[0].reduced_scattering[cell],
                1e-12);
  }
  EXPECT_THAT(found.channels[2].absorption, ::testing::Each(0.0));
  EXPECT_THAT(on_grid(material(coarse, 0.0), fine).channels[1].reduced_scattering,
              ::testing::Each(::testing::DoubleNear(1.0, 1e-12)));
}

}  // namespace
}  // namespace opaline::reconstruct
