#include "sim/light_transport.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <numbers>
#include <thread>

#include "sim/fresnel.h"
#include "sim/light_transport_medium.h"
#include "sim/photon_batch.h"

namespace opaline::sim {
namespace {

constexpr auto kZMinIndex = static_cast<std::size_t>(Face::kZMin);
constexpr auto kZMaxIndex = static_cast<std::size_t>(Face::kZMax);

ChannelCoefficients uniform(const Block& block, double absorption, double scattering) {
  return {std::vector<double>(block.cell_count(), absorption),
          std::vector<double>(block.cell_count(), scattering)};
}

// Within 4 standard deviations of the estimate, and what the reference was rounded to.
void expect_close(TallyValue value, double scale, double reference, double rounding) {
  EXPECT_NEAR(value.mean / scale, reference, 4.0 * std::sqrt(value.variance) / scale + rounding);
}

TransportTally trace_slab(const Block& block,
                          double ior,
                          const ChannelCoefficients& coefficients,
                          TransportOptions options,
                          bool diffuse = false) {
  options.periodic_sides = true;
  auto tally =
      trace(block, ior, coefficients, whole_face(block, Face::kZMin, diffuse), options, {});
  EXPECT_TRUE(tally) << tally.error().message;
  return *std::move(tally);
}

double total(const TransportTally& tally) {
  double sum = tally.specular.mean + tally.absorbed.mean + tally.unscattered.mean;
  for (const TallyValue& face : tally.escaped) sum += face.mean;
  return sum;
}

TEST(LightTransport, MeetsVanDeHulstsForwardScatteringSlab) {
  // sigma_a = 1, sigma_s = 9 per mm, g = 0.75, 0.2 mm, matched index; unscattered light counts (van
  // de Hulst 1980).
  const Block block{1, 1, 1, 1.0, 1.0, 0.2};
  const TransportTally tally =
      trace_slab(block,
                 1.0,
                 uniform(block, 1.0, 9.0 * 0.25),
                 {.photons = 1 << 23, .anisotropy = 0.75, .count_unscattered = true});
  expect_close(tally.escaped[kZMinIndex], 1.0, 0.09739, 5e-6);
  expect_close(tally.escaped[kZMaxIndex], 1.0, 0.66096, 5e-6);
}

TEST(LightTransport, MeetsGiovanellisHalfSpaceWithAReflectingSurface) {
  const Block block{1, 1, 1, 1.0, 1.0, 6.0};  // optical depth 60 is as good as infinite
  const TransportTally tally =
      trace_slab(block, 1.5, uniform(block, 1.0, 9.0), {.photons = 1 << 19});
  EXPECT_NEAR(tally.specular.mean, 0.04, 1e-12);
  expect_close(tally.escaped[kZMinIndex], 1.0, 0.2600 - 0.04, 5e-5);
}

TEST(LightTransport, MeetsHeasletAndWarmingForDiffuseLight) {
  // Diffuse light on a conservative, isotropic slab is the radiation between black plates: T = 0.5532 and 0.3900 at an
  // optical thickness of 1 and 2 (Heaslet & Warming 1965).
  for (const auto& [thickness, transmitted] : {std::pair{1.0, 0.5532}, std::pair{2.0, 0.3900}}) {
    const Block block{1, 1, 1, 1.0, 1.0, thickness};
    const TransportTally tally = trace_slab(block,
                                            1.0,
                                            uniform(block, 0.0, 1.0),
                                            {.photons = 1 << 20, .count_unscattered = true},
                                            true);
    expect_close(tally.escaped[kZMaxIndex], 1.0, transmitted, 5e-5);
    expect_close(tally.escaped[kZMinIndex], 1.0, 1.0 - transmitted, 5e-5);
  }
}

TEST(LightTransport, ReflectsDiffuseLightAtEntryAsFresnelsEquationsIntegrate) {
  const Block block{1, 1, 1, 1.0, 1.0, 1.0};
  const TransportTally tally =
      trace_slab(block, 1.5, uniform(block, 1.0, 1.0), {.photons = 1 << 18}, true);
  constexpr int kSteps = 100'000;  // of the midpoint rule, in cos^2: 2 mu d(mu) = d(mu^2)
  double integral = 0.0;
  for (int i = 0; i < kSteps; ++i) {
    integral += reflectance(std::sqrt((i + 0.5) / kSteps), 1.0, 1.5) / kSteps;
  }
  EXPECT_NEAR(integral, 0.0918, 5e-5);  // as tables have it
  expect_close(tally.specular, 1.0, integral, 1e-6);
}

TEST(LightTransport, MeetsDiscreteOrdinatesForSlabsOfTheDemosMaterial) {
  struct Case {
    double thickness;
    double reflected;
    double transmitted;
  };
  for (const Case& c : {Case{5.0, 0.5944, 0.245}, Case{10.0, 0.6473, 0.100}}) {
    const Block block{1, 1, 1, 1.0, 1.0, c.thickness};
    const TransportTally tally =
        trace_slab(block, 1.3, uniform(block, 0.01, 1.0), {.photons = 1 << 18});
    const double entered = tally.incident - tally.specular.mean;
    expect_close(tally.escaped[kZMinIndex], entered, c.reflected, 5e-5);
    expect_close(tally.escaped[kZMaxIndex], entered, c.transmitted, 5e-4);
  }
}

TEST(LightTransport, TransmitsDiffuseLightEquallyThroughTwoLayersInEitherOrder) {
  const Block block{1, 1, 2, 1.0, 1.0, 2.5};
  const ChannelCoefficients forth{{0.01, 0.04}, {0.99, 3.96}};
  const ChannelCoefficients back{{0.04, 0.01}, {3.96, 0.99}};
  const TransportOptions options{.photons = 1 << 18};
  const TallyValue a = trace_slab(block, 1.3, forth, options, true).escaped[kZMaxIndex];
  const TallyValue b = trace_slab(block, 1.3, back, options, true).escaped[kZMaxIndex];
  EXPECT_GT(a.mean, 0.05);
  EXPECT_NEAR(a.mean, b.mean, 4.0 * std::sqrt(a.variance + b.variance));
}

TEST(LightTransport, AttenuatesUnscatteredLightByTheVoxelsItPasses) {
  // Delta tracking against Beer's law: with a matched index what never scatters leaves with e^-tau,
  // tau summed over voxels of very different extinction, whatever the largest one is.
  const Block block{1, 1, 4, 1.0, 1.0, 0.5};
  const ChannelCoefficients layers{{0.0, 0.5, 0.1, 0.0}, {0.02, 2.0, 0.3, 0.7}};
  const TransportTally tally = trace_slab(block, 1.0, layers, {.photons = 1 << 19});
  const double tau = 0.5 * (0.02 + 2.5 + 0.4 + 0.7);
  expect_close(tally.unscattered, 1.0, std::exp(-tau), 1e-6);
}

TEST(LightTransport, AccountsForAllLightThatCameIn) {
  const Block block{6, 5, 4, 0.5, 0.7, 0.9};
  ChannelCoefficients coefficients = uniform(block, 0.02, 1.5);
  for (std::size_t i = 0; i < block.cell_count(); i += 3) coefficients.absorption[i] = 0.3;
  for (const Face face : kFaces) {
    const LightEntry entry = whole_face(block, face, face == Face::kYMax);
    const auto tally = trace(block, 1.4, coefficients, entry, {.photons = 1 << 16}, {});
    ASSERT_TRUE(tally);
    // Only roulette on dim photons (weight under 0.02) makes the sum differ at all.
    EXPECT_NEAR(total(*tally), tally->incident, 2e-3 * tally->incident) << to_string(face);
  }
}

TEST(LightTransport, LosesNothingWithoutAbsorption) {
  const Block block{4, 4, 4, 0.5, 0.5, 0.5};
  const auto tally = trace(block,
                           3.0,
                           uniform(block, 0.0, 2.0),
                           whole_face(block, Face::kXMin),
                           {.photons = 1 << 15},
                           {});
  ASSERT_TRUE(tally);
  EXPECT_EQ(tally->absorbed.mean, 0.0);
  EXPECT_NEAR(total(*tally), tally->incident, 1e-6 * tally->incident);  // single-precision weights
}

TEST(LightTransport, ExitanceOfTheCellsAddsUpToWhatEscaped) {
  const Block block{6, 5, 4, 0.5, 0.7, 0.9};
  const auto tally = trace(block,
                           1.3,
                           uniform(block, 0.01, 1.0),
                           whole_face(block, Face::kZMin),
                           {.photons = 1 << 15},
                           {});
  ASSERT_TRUE(tally);
  for (const Face face : kFaces) {
    const auto i = static_cast<std::size_t>(face);
    double watts = 0.0;
    for (const double m : tally->exitance[i].mean.samples())
      watts += m * block.face_cell_area(face);
    EXPECT_NEAR(watts, tally->escaped[i].mean, 1e-9 * tally->incident) << to_string(face);
  }
}

TEST(LightTransport, IsTheSameToTheBitForAnyNumberOfThreads) {
  const Block block{8, 8, 4, 0.5, 0.5, 0.5};
  TransportOptions options{
      .photons = 20 * kBatchPhotons,
      .radiance = RadianceTally{Face::kZMax, camera_above(block, 100.0, 20.0)}};
  options.threads = 1;
  const LightEntry entry = whole_face(block, Face::kZMin);
  const auto one = trace(block, 1.3, uniform(block, 0.01, 2.0), entry, options, {});
  options.threads = 5;
  const auto five = trace(block, 1.3, uniform(block, 0.01, 2.0), entry, options, {});
  ASSERT_TRUE(one && five);
  EXPECT_EQ(one->radiance.mean, five->radiance.mean);
  EXPECT_EQ(one->radiance.variance, five->radiance.variance);
  EXPECT_EQ(one->exitance[kZMaxIndex].mean, five->exitance[kZMaxIndex].mean);
}

TEST(LightTransport, EstimatesItsOwnVariance) {
  // Variance as estimated inside each run against the scatter between runs with other seeds.
  const Block block{6, 6, 6, 0.5, 0.5, 0.5};
  constexpr int kRuns = 24;
  TransportOptions options{
      .photons = 8 * kBatchPhotons,
      .radiance = RadianceTally{Face::kZMax, camera_above(block, 100.0, 10.0)}};
  std::vector<double> sum(36);
  std::vector<double> square(36);
  std::vector<double> estimated(36);
  for (int run = 0; run < kRuns; ++run) {
    options.seed = 100 + run;
    const auto tally =
        trace(block, 1.3, uniform(block, 0.01, 1.5), whole_face(block, Face::kZMin), options, {});
    ASSERT_TRUE(tally);
    for (std::size_t i = 0; i < 36; ++i) {
      const double value = tally->radiance.mean.samples()[i];
      sum[i] += value;
      square[i] += value * value;
      estimated[i] += tally->radiance.variance.samples()[i] / kRuns;
    }
  }
  double ratio = 0.0;
  for (std::size_t i = 0; i < 36; ++i) {
    const double mean = sum[i] / kRuns;
    ratio += (square[i] / kRuns - mean * mean) * kRuns / (kRuns - 1) / estimated[i] / 36;
  }
  // sqrt(2 / (23 x 36)) = 0.05 if cells were independent; a photon is seen in a few of them.
  EXPECT_NEAR(ratio, 1.0, 0.25);
}

TEST(LightTransport, ShowsASymmetricSampleSymmetrically) {
  const Block block{6, 6, 6, 0.5, 0.5, 0.5};
  const TransportOptions options{
      .photons = 1 << 17, .radiance = RadianceTally{Face::kZMax, camera_above(block, 100.0, 0.0)}};
  const auto tally =
      trace(block, 1.3, uniform(block, 0.01, 1.5), whole_face(block, Face::kZMin), options, {});
  ASSERT_TRUE(tally);
  const Image<double>& mean = tally->radiance.mean;
  const Image<double>& variance = tally->radiance.variance;
  for (int y = 0; y < 6; ++y) {
    for (int x = 0; x < 6; ++x) {
      const double sigma = std::sqrt(variance.at(x, y) + variance.at(5 - x, y));
      EXPECT_NEAR(mean.at(x, y), mean.at(5 - x, y), 4.5 * sigma);
      EXPECT_NEAR(mean.at(x, y), mean.at(y, x), 4.5 * sigma);
    }
  }
}

TEST(LightTransport, SeesTheSameThroughEveryFace) {
  // A cube lit and seen through other faces is the same cube turned.
  const Block block{4, 4, 4, 0.75, 0.75, 0.75};
  const ChannelCoefficients coefficients = uniform(block, 0.02, 1.5);
  const auto seen = [&](Face lit, Face face, Vec3 centre) {
    const TransportOptions options{.photons = 1 << 16,
                                   .stream = static_cast<std::uint64_t>(face),
                                   .radiance = RadianceTally{face, centre}};
    auto tally = trace(block, 1.3, coefficients, whole_face(block, lit), options, {});
    EXPECT_TRUE(tally);
    double sum = 0.0;
    double variance = 0.0;
    for (const double v : tally->radiance.mean.samples()) sum += v;
    for (const double v : tally->radiance.variance.samples())
      variance += 2.0 * v;  // cells are correlated
    return TallyValue{sum, variance};
  };
  const TallyValue reference = seen(Face::kZMin, Face::kZMax, {1.5, 1.5, 103.0});
  const std::array others{seen(Face::kZMax, Face::kZMin, {1.5, 1.5, -100.0}),
                          seen(Face::kXMin, Face::kXMax, {103.0, 1.5, 1.5}),
                          seen(Face::kYMax, Face::kYMin, {1.5, -100.0, 1.5})};
  for (const TallyValue& other : others) {
    EXPECT_NEAR(other.mean, reference.mean, 4.0 * std::sqrt(other.variance + reference.variance));
  }
}

TEST(LightTransport, StepsAlikeWithAndWithoutWideVectors) {
  const Block block{2, 3, 4, 0.5, 0.6, 0.7};
  const LightTransportMedium medium = make_medium(block, 1.3, uniform(block, 0.1, 2.0), 0.4, false);
  const LightEntry entry = whole_face(block, Face::kZMin);
  BatchSums wide;
  BatchSums portable;
  trace_batch({medium, entry}, 7, wide);
  trace_batch({.medium = medium, .entry = entry, .step = portable_step_function()}, 7, portable);
  EXPECT_EQ(wide.absorbed, portable.absorbed);
  EXPECT_EQ(wide.escaped, portable.escaped);
}

TEST(LightTransport, StepsAlikeTowardsACameraToo) {
  const Block block{2, 3, 4, 0.5, 0.6, 0.7};
  LightTransportMedium medium = make_medium(block, 1.3, uniform(block, 0.1, 2.0), 0.0, false);
  thin_connections(medium, Face::kZMax);
  const CameraConnection camera(medium, Face::kZMax, camera_above(block, 50.0, 20.0));
  const LightEntry entry = whole_face(block, Face::kZMin);
  BatchSums wide;
  BatchSums portable;
  wide.radiance.resize(6);
  portable.radiance.resize(6);
  trace_batch({.medium = medium, .entry = entry, .camera = &camera}, 7, wide);
  trace_batch(
      {.medium = medium, .entry = entry, .camera = &camera, .step = portable_step_function()},
      7,
      portable);
  EXPECT_GT(wide.radiance[0], 0.0);
  EXPECT_EQ(wide.radiance, portable.radiance);
  EXPECT_EQ(wide.escaped, portable.escaped);
}

TEST(LightTransport, ConnectsWithAChanceThatItsRandomNumbersCanHave) {
  // They have 24 bits. Deep in a thick block, where a connection carries e^-70 of the light, the chance is one of them.
  const Block block{1, 1, 4, 1.0, 1.0, 5.0};
  const ChannelCoefficients layers{{0.0, 1.0, 0.0, 0.0}, {3.0, 1.0, 0.3, 4.0}};
  LightTransportMedium medium = make_medium(block, 1.3, layers, 0.0, false);
  thin_connections(medium, Face::kZMax);
  for (const VoxelOptics& voxel : medium.voxels) {
    const double steps = voxel.look * 0x1p24;
    EXPECT_GE(steps, 1.0);
    EXPECT_EQ(steps, std::floor(steps));
  }
}

TEST(LightTransport, StopsInTheMiddleOfABatch) {
  // Trapped: some 10^7 steps a photon, thousands of photons a batch.
  const Block block{1, 1, 1, 8.0, 8.0, 8.0};
  std::stop_source stop;
  std::jthread later([&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    stop.request_stop();
  });
  const auto start = std::chrono::steady_clock::now();
  const auto tally = trace(block,
                           3.0,
                           uniform(block, 0.0, 1000.0),
                           whole_face(block, Face::kZMin, true),
                           {.photons = 1, .threads = 1},
                           stop.get_token());
  ASSERT_FALSE(tally);
  EXPECT_EQ(tally.error().code, ErrorCode::kCancelled);
  EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(2));
}

TEST(LightTransport, StopsSoonWhenAsked) {
  const Block block{8, 8, 8, 1.0, 1.0, 1.0};
  std::stop_source stop;
  std::jthread later([&] { stop.request_stop(); });
  const auto tally = trace(block,
                           1.3,
                           uniform(block, 0.0, 3.0),
                           whole_face(block, Face::kZMin),
                           {.photons = std::uint64_t{1} << 40},
                           stop.get_token());
  ASSERT_FALSE(tally);
  EXPECT_EQ(tally.error().code, ErrorCode::kCancelled);
}

TEST(LightTransport, RefusesWhatItCannotTrace) {
  const Block block{2, 2, 2, 1.0, 1.0, 1.0};
  const ChannelCoefficients good = uniform(block, 0.01, 1.0);
  const LightEntry entry = whole_face(block, Face::kZMin);
  const auto refused = [&](double ior,
                           const ChannelCoefficients& c,
                           const LightEntry& e,
                           const TransportOptions& o) {
    const auto tally = trace(block, ior, c, e, o, {});
    return !tally && tally.error().code == ErrorCode::kInvalidArgument;
  };
  EXPECT_TRUE(refused(0.9, good, entry, {}));
  EXPECT_TRUE(refused(1.3, uniform(block, 0.01, 0.0), entry, {}));
  EXPECT_TRUE(refused(1.3, uniform(block, std::nan(""), 1.0), entry, {}));
  EXPECT_TRUE(refused(1.3, uniform(block, 0.0, 1e-5), entry, {}));
  EXPECT_TRUE(refused(1.3, {good.absorption, {1.0}}, entry, {}));
  EXPECT_TRUE(refused(1.3, good, {.column_end = 3.0, .row_end = 1.0}, {}));
  EXPECT_TRUE(refused(1.3, good, {.column_end = 1.0}, {}));
  EXPECT_TRUE(refused(1.3, good, entry, {.anisotropy = 1.0}));
  EXPECT_TRUE(refused(1.3, good, entry, {.radiance = RadianceTally{Face::kZMax, {1.0, 1.0, 2.5}}}));
  EXPECT_TRUE(refused(1.3, good, whole_face(block, Face::kXMin), {.periodic_sides = true}));
}

TEST(Fresnel, IsExactAtItsLimits) {
  EXPECT_DOUBLE_EQ(reflectance(1.0, 1.0, 1.5), 0.04);
  EXPECT_DOUBLE_EQ(reflectance(1.0, 1.5, 1.0), 0.04);
  EXPECT_DOUBLE_EQ(reflectance(0.0, 1.0, 1.3), 1.0);
  EXPECT_NEAR(reflectance(0.3, 1.0, 1.0), 0.0, 1e-30);
  EXPECT_DOUBLE_EQ(reflectance(std::cos(std::asin(1.0 / 1.3) + 1e-9), 1.3, 1.0), 1.0);
  // At Brewster's angle only s-polarised light is reflected: R = ((n^2 - 1) / (n^2 + 1))^2 / 2.
  EXPECT_NEAR(
      reflectance(std::cos(std::atan(1.5)), 1.0, 1.5), 0.5 * std::pow(1.25 / 3.25, 2), 1e-15);
}

}  // namespace
}  // namespace opaline::sim
