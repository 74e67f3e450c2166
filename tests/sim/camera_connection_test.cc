#include "sim/camera_connection.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <numbers>
#include <span>

#include "sim/fresnel.h"
#include "sim/light_transport.h"
#include "sim/photon_lanes.h"

namespace opaline::sim {
namespace {

constexpr auto kZMaxIndex = static_cast<std::size_t>(Face::kZMax);
constexpr double kFar = 1e6;  // mm: directions to the camera are the same all over the block

ChannelCoefficients uniform(const Block& block, double absorption, double scattering) {
  return {std::vector<double>(block.cell_count(), absorption),
          std::vector<double>(block.cell_count(), scattering)};
}

Vec3 camera_towards(const Block& block, double cosine, double azimuth) {
  const double sine = std::sqrt(1.0 - cosine * cosine);
  const Vec3 direction{sine * std::cos(azimuth), sine * std::sin(azimuth), cosine};
  return Vec3{0.5 * block.size().x, 0.5 * block.size().y, block.size().z} + direction * kFar;
}

/// Power through z_max, W: once as escaped photons, once as the integral of L cos over the face and the directions.
struct Powers {
  TallyValue escaped;
  TallyValue seen;
};

/// Gauss-Legendre, 6 nodes on (0, 1), over cos^2 (the integrand is smooth in it), midpoints over the azimuth.
Powers measure(const Block& block,
               double ior,
               const ChannelCoefficients& coefficients,
               TransportOptions options,
               std::span<const double> azimuths,
               Face lit = Face::kZMin) {
  constexpr std::array nodes{
      0.0337652429, 0.1693953068, 0.3806904070, 0.6193095930, 0.8306046932, 0.9662347571};
  constexpr std::array weights{
      0.0856622462, 0.1803807865, 0.2339569673, 0.2339569673, 0.1803807865, 0.0856622462};
  Powers powers;
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    for (const double azimuth : azimuths) {
      const double weight =
          std::numbers::pi * weights[i] /
          static_cast<double>(azimuths.size());  // cos d(omega) = d(cos^2)/2 d(phi)
      options.radiance =
          RadianceTally{Face::kZMax, camera_towards(block, std::sqrt(nodes[i]), azimuth)};
      ++options.stream;
      const auto tally = trace(block, ior, coefficients, whole_face(block, lit), options, {});
      EXPECT_TRUE(tally);
      const double scale = weight * block.face_cell_area(Face::kZMax);
      for (std::size_t cell = 0; cell < tally->radiance.mean.samples().size(); ++cell) {
        powers.seen.mean += scale * tally->radiance.mean.samples()[cell];
        powers.seen.variance += scale * scale * tally->radiance.variance.samples()[cell];
      }
      powers.escaped = tally->escaped[kZMaxIndex];
    }
  }
  return powers;
}

void expect_equal(const Powers& powers, double quadrature) {
  // Cells of one trace are correlated (a photon is seen in several): their variances add up to no more than twice.
  const double sigma = std::sqrt(2.0 * powers.seen.variance + powers.escaped.variance);
  EXPECT_NEAR(powers.seen.mean, powers.escaped.mean, 4.0 * sigma + quadrature * powers.escaped.mean)
      << "ratio " << powers.seen.mean / powers.escaped.mean << " sigma "
      << sigma / powers.escaped.mean;
}

TEST(CameraConnection, RadianceOfASlabIntegratesToItsExitance) {
  const Block block{1, 1, 10, 1.0, 1.0, 0.5};
  const std::array azimuths{0.3};
  const TransportOptions options{.photons = 1 << 17, .periodic_sides = true};
  expect_equal(measure(block, 1.3, uniform(block, 0.01, 1.0), options, azimuths), 1e-3);
}

TEST(CameraConnection, RadianceOfAForwardScatteringSlabIntegratesToItsExitance) {
  const Block block{1, 1, 4, 1.0, 1.0, 0.5};
  const std::array azimuths{0.3};
  const TransportOptions options{.photons = 1 << 16, .anisotropy = 0.8, .periodic_sides = true};
  expect_equal(measure(block, 1.0, uniform(block, 0.05, 1.5), options, azimuths), 2e-3);
}

TEST(CameraConnection, RadianceOfASmallBlockIntegratesToItsExitanceSidesIncluded) {
  // A quarter of the light seen near an edge comes by way of a side. The block is square, so that midpoints of sixteen
  // azimuths are two different ones.
  const Block block{4, 4, 4, 0.75, 0.75, 0.75};
  const std::array azimuths{std::numbers::pi / 16, 3 * std::numbers::pi / 16};
  const TransportOptions options{.photons = 1 << 17};
  expect_equal(measure(block, 1.3, uniform(block, 0.02, 2.0), options, azimuths), 1e-3);
}

TEST(CameraConnection, RadianceOfAMixedBlockIntegratesToItsExitance) {
  // Every voxel another material, up to four times as dense as its neighbour. Nothing is symmetric: all azimuths.
  const Block block{4, 4, 4, 0.75, 0.75, 0.75};
  SplitMix random(5);
  ChannelCoefficients mixed = uniform(block, 0.0, 0.0);
  for (std::size_t i = 0; i < block.cell_count(); ++i) {
    const double density = std::pow(4.0, random.uniform());
    mixed.absorption[i] = 0.02 * density * random.uniform();
    mixed.reduced_scattering[i] = density;
  }
  std::array<double, 12> azimuths{};
  for (std::size_t i = 0; i < azimuths.size(); ++i) {
    azimuths[i] = 2.0 * std::numbers::pi * (static_cast<double>(i) + 0.5) / azimuths.size();
  }
  const TransportOptions options{.photons = 1 << 15};
  expect_equal(measure(block, 1.3, mixed, options, azimuths), 1e-3);
}

TEST(CameraConnection, RadianceOfTheLitFaceIntegratesToItsExitance) {
  // Lit from in front: most of what is seen has scattered once or twice, right under the face.
  const Block block{4, 4, 4, 0.75, 0.75, 0.75};
  const std::array azimuths{std::numbers::pi / 16, 3 * std::numbers::pi / 16};
  const TransportOptions options{.photons = 1 << 17};
  expect_equal(measure(block, 1.3, uniform(block, 0.02, 2.0), options, azimuths, Face::kZMax),
               2e-3);
}

TEST(CameraConnection, TurnedBy40DegreesSeesAnotherPicture) {
  const Block block{12, 12, 8, 0.75, 0.75, 0.75};
  TransportOptions options{.photons = 1 << 17, .tally_exitance = false};
  const LightEntry entry = patch_of_face(block, Face::kZMin, 3, 3, 1, 1);
  const auto seen_at = [&](double degrees, std::uint64_t stream) {
    options.radiance = RadianceTally{Face::kZMax, camera_above(block, 300.0, degrees)};
    options.stream = stream;
    return trace(block, 1.3, uniform(block, 0.01, 1.5), entry, options, {});
  };
  const auto straight = seen_at(0.0, 1);
  const auto again = seen_at(0.0, 2);
  const auto turned = seen_at(40.0, 3);
  ASSERT_TRUE(straight && again && turned);
  const auto chi_squared = [&](const TransportTally& a, const TransportTally& b) {
    double sum = 0.0;
    for (std::size_t i = 0; i < a.radiance.mean.samples().size(); ++i) {
      const double difference = a.radiance.mean.samples()[i] - b.radiance.mean.samples()[i];
      sum += difference * difference /
             (a.radiance.variance.samples()[i] + b.radiance.variance.samples()[i]);
    }
    return sum / static_cast<double>(a.radiance.mean.samples().size());
  };
  // 144 cells: chi^2 per cell has a standard deviation of sqrt(2/144) = 0.12, more as neighbours are correlated.
  EXPECT_NEAR(chi_squared(*straight, *again), 1.0, 0.5);
  EXPECT_GT(chi_squared(*straight, *turned), 2.0);
}

TEST(CameraConnection, RadianceFallsWithTheAngleAsTheP1FieldSays) {
  // L(mu_o) ~ Ft (2A + 3 mu_i) on a transmitting face (docs/physics.md), A = 2.34053 at n = 1.3; good to 2 % there.
  const Block block{1, 1, 12, 1.0, 1.0, 0.5};
  TransportOptions options{.photons = 1 << 17, .periodic_sides = true, .tally_exitance = false};
  const auto radiance_at = [&](double cosine) {
    options.radiance = RadianceTally{Face::kZMax, camera_towards(block, cosine, 0.0)};
    const auto tally =
        trace(block, 1.3, uniform(block, 0.005, 1.5), whole_face(block, Face::kZMin), options, {});
    return TallyValue{tally->radiance.mean.at(0, 0), tally->radiance.variance.at(0, 0)};
  };
  const double cosine = std::cos(40.0 * std::numbers::pi / 180.0);
  const TallyValue straight = radiance_at(1.0);
  const TallyValue turned = radiance_at(cosine);
  const double inside = std::sqrt(1.0 - (1.0 - cosine * cosine) / (1.3 * 1.3));
  const double expected = (1.0 - reflectance(cosine, 1.0, 1.3)) * (2 * 2.34053 + 3 * inside) /
                          ((1.0 - reflectance(1.0, 1.0, 1.3)) * (2 * 2.34053 + 3));
  const double noise = std::sqrt(straight.variance) / straight.mean;  // both have about the same
  EXPECT_NEAR(turned.mean / straight.mean, expected, 0.02 + 4.0 * std::sqrt(2.0) * noise);
}

TEST(CameraConnection, RefractedRayObeysSnellAndLandsOnTheCamera) {
  for (const double height : {6.0, 300.0, 1e6}) {
    for (const double lateral : {0.0, 0.1, 5.0, 400.0}) {
      for (const double depth : {0.0, 0.01, 6.0}) {
        const RefractedRay ray = refract_to_camera(depth, height, lateral * lateral, 1.4);
        const double sine_inside = std::sqrt(1.0 - ray.cosine_inside * ray.cosine_inside);
        const double sine_outside = std::sqrt(1.0 - ray.cosine_outside * ray.cosine_outside);
        EXPECT_NEAR(sine_outside, 1.4 * sine_inside, 1e-6);
        EXPECT_NEAR(ray.share_inside * lateral, depth * sine_inside / ray.cosine_inside, 1e-6);
        EXPECT_NEAR((1.0 - ray.share_inside) * lateral,
                    height * sine_outside / ray.cosine_outside,
                    1e-6 * height);
      }
    }
  }
}

TEST(CameraConnection, SolidAngleIsTheDerivativeOfTheLandingPoint) {
  // Shoot rays about the solution and see where they cross the camera's height.
  constexpr double kDepth = 4.0;
  constexpr double kHeight = 9.0;
  constexpr double kLateral = 7.0;
  constexpr double kIor = 1.3;
  const RefractedRay ray = refract_to_camera(kDepth, kHeight, kLateral * kLateral, kIor);
  const auto landing = [](double inside) {
    const double outside = std::asin(kIor * std::sin(inside));
    return kDepth * std::tan(inside) + kHeight * std::tan(outside);
  };
  const double inside = std::acos(ray.cosine_inside);
  EXPECT_NEAR(landing(inside), kLateral, 1e-8);
  constexpr double kStep = 1e-5;
  const double slope = (landing(inside + kStep) - landing(inside - kStep)) / (2.0 * kStep);
  const double area_per_solid_angle = kLateral * slope * ray.cosine_outside / std::sin(inside);
  EXPECT_NEAR(ray.solid_angle_per_area * area_per_solid_angle, 1.0, 1e-7);
}

}  // namespace
}  // namespace opaline::sim
