#include "sim/blob.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "sim/blob_transfer.h"
#include "sim/exit_light.h"

namespace opaline::sim {
namespace {

const Vec3 kCamera{0.0, 0.0, 1000.0};

Blob named(std::string_view name) { return Blob(*blob_of_name(name, 10.0)); }

SeenPlace seen(const Blob& blob, double x, double y) {
  const Vec3 way = normalized(Vec3{x, y, 0.0} - kCamera);
  const Vec3 point = kCamera + way * *blob.meets(kCamera, way);
  return {point, blob.normal(point), way * -1.0};
}

BlobMaterial of(double albedo, double free_path_mm) {
  return {{1.0 / free_path_mm, albedo}, {}, BlobMixture::kNone, 10.0, 1.0, 1.4};
}

BlobTransfer transfer(const Blob& blob,
                      const BlobMaterial& material,
                      const SeenPlace& place,
                      std::int64_t paths) {
  ThreadTeam team(2);
  const std::array places{place};
  return trace_transfer(blob, material, places, {paths, 0.0}, 7, team, {}, {})->front();
}

/// Radiance under constant light of 1: int Y_00 = sqrt(4 pi).
double constant(const BlobTransfer& t) { return std::sqrt(4.0 * std::acos(-1.0)) * t.terms[0]; }
/// And under the gradients: Y_1 = sqrt(3/(4 pi)) (y, z, x).
Vec3 gradient(const BlobTransfer& t) {
  const double scale = std::sqrt(4.0 * std::acos(-1.0) / 3.0);
  return Vec3{t.terms[3], t.terms[1], t.terms[2]} * scale;
}

TEST(Blob, HasNormalsAcrossItsSurface) {
  const Blob blob = named("blob_b");
  for (const auto& [x, y] : {std::pair{0.0, 0.0}, {4.0, 2.0}, {-5.0, 3.0}, {2.0, -6.0}}) {
    const SeenPlace here = seen(blob, x, y);
    const Vec3 right = seen(blob, x + 1e-3, y).point - here.point;
    const Vec3 up = seen(blob, x, y + 1e-3).point - here.point;
    EXPECT_NEAR(dot(here.normal, normalized(right)), 0.0, 2e-3);  // the step times the curvature
    EXPECT_NEAR(dot(here.normal, normalized(up)), 0.0, 2e-3);
    EXPECT_NEAR(blob.height(here.point), 0.0, 1e-4);
  }
}

TEST(Blob, BendsAsItsNameSays) {
  EXPECT_NEAR(named("ball").mean_curvature({3.0, 5.0, 8.0}), 1.0 / std::sqrt(98.0), 1e-6);
  EXPECT_LT(named("dent").mean_curvature(seen(named("dent"), 1.0, 0.7).point), -0.05);
  for (int x = -6; x <= 6; x += 2)
    for (int y = -6; y <= 6; y += 2)
      EXPECT_GT(named("blob_a").mean_curvature(seen(named("blob_a"), x, y).point), 0.0);
}

TEST(Blob, LetsNoRayThroughItsSurfaceUnseen) {
  const Blob blob = named("blob_b");
  PathNumbers numbers(3);
  for (int n = 0; n < 2000; ++n) {
    const double z = 2.0 * numbers.next() - 1.0;
    const double turn = 6.283185307179586 * numbers.next();
    const Vec3 way{
        std::sqrt(1.0 - z * z) * std::cos(turn), std::sqrt(1.0 - z * z) * std::sin(turn), z};
    const Vec3 from{3.0 * numbers.next(), 2.0 * numbers.next(), -3.0 * numbers.next()};
    const auto out = blob.leaves(from, way, 100.0);
    ASSERT_TRUE(out);
    EXPECT_NEAR(blob.height(from + way * *out), 0.0, 1e-4);
    for (double share = 0.02; share < 0.99; share += 0.02)
      ASSERT_LT(blob.height(from + way * (share * *out)), 1e-4);
    EXPECT_FALSE(blob.leaves(from, way, 0.99 * *out));
  }
}

TEST(Blob, RefusesDentsThatReachTheMiddle) {
  BlobShape shape{10.0, {{{0, 0, 1}, -0.7, 0.5}}};
  EXPECT_FALSE(validate(shape));
  EXPECT_FALSE(blob_of_name("potato", 10.0));
}

// Light that enters a ball at one point, sorted by where it leaves (exit_light), and paths from the camera through a body's surface (here) are
// different walks by different code; they say the same within four deviations.
TEST(BlobWalk, SeesOnABallWhatLightThatEntersItSays) {
  const double albedo = 0.95;
  const double free_path = 0.6;
  ThreadTeam team(2);
  constexpr std::array kEdges{0.36, 0.44};  // of the cosine's square, about 0.63
  const ExitLight light =
      trace_exit_light({albedo, 10.0 / free_path, 1.4}, kEdges, 800'000, 2, team)->front();
  const Blob blob = named("ball");
  const double across = 10.0 * std::sqrt(1.0 - light.cosine * light.cosine);
  const SeenPlace place{
      {across, 0.0, 10.0 * light.cosine}, {across / 10.0, 0.0, light.cosine}, {0.0, 0.0, 1.0}};
  const BlobTransfer t = transfer(blob, of(albedo, free_path), place, 20'000);
  const double noise = std::sqrt(t.variance) / t.terms[0];
  EXPECT_NEAR(constant(t) / light.reflectance,
              1.0,
              4.0 * std::hypot(noise, light.reflectance_deviation / light.reflectance));
  const Vec3 g = gradient(t);
  // less noise than in the constant light alone: they share paths
  EXPECT_NEAR(constant(t) / length(g) / light.ratio, 1.0, 4.0 * noise);
  const double tilt = std::atan2(g.x, g.z) - std::acos(light.cosine);
  EXPECT_GT(light.tilt, 5.0 * light.tilt_deviation);
  EXPECT_NEAR(tilt, light.tilt, 4.0 * std::hypot(noise, light.tilt_deviation));
}

TEST(BlobWalk, TracksTwoEqualMaterialsAsOne) {
  BlobMaterial mixed = of(0.95, 0.6);
  const Blob blob = named("blob_a");
  const SeenPlace place = seen(blob, 3.0, 1.0);
  const double one = constant(transfer(blob, mixed, place, 20'000));
  mixed.second = mixed.first;
  mixed.mixture = BlobMixture::kBands;
  const BlobTransfer both = transfer(blob, mixed, place, 20'000);
  const double noise = std::sqrt(2.0 * both.variance) / both.terms[0];
  EXPECT_NEAR(constant(both) / one, 1.0, 4.0 * noise);
  mixed.second.extinction =
      4.0 / 0.6;  // the walk knows places: far from the second, the first alone counts
  mixed.mixture = BlobMixture::kHalves;
  mixed.blur_mm = 0.3;
  const double left = constant(transfer(blob, mixed, seen(blob, -7.0, 0.0), 20'000));
  const double alone = constant(transfer(blob, of(0.95, 0.6), seen(blob, -7.0, 0.0), 20'000));
  EXPECT_NEAR(left / alone, 1.0, 4.0 * noise);
}

// Under even light a body that hardly absorbs shows the same radiance everywhere, 1 - F less what scattered once, also where it hides a part of the
// light from itself: what it hides it replaces by its own (second law of thermodynamics). Absorption takes 130 collisions times 1e-4, and the dent
// keeps light longer: 2 %.
TEST(BlobWalk, LightsItselfInADent) {
  const Blob blob = named("dent");
  const BlobMaterial material = of(0.9999, 0.2);
  const auto share = [&](double x, double y, double& noise) {
    const SeenPlace place = seen(blob, x, y);
    const BlobTransfer t = transfer(blob, material, place, 6'000);
    noise = std::sqrt(t.variance) / t.terms[0];
    return constant(t) / (1.0 - reflectance(dot(place.normal, place.to_camera), 1.0, 1.4));
  };
  double noise_inside = 0.0;
  double noise_outside = 0.0;
  const double inside = share(1.5, 1.0, noise_inside);
  const double outside = share(-5.0, -4.0, noise_outside);
  EXPECT_NEAR(inside / outside, 1.0, 0.02 + 4.0 * std::hypot(noise_inside, noise_outside));
}

TEST(Harmonics, AreOrthonormal) {
  std::array<double, kTransferTerms> diagonal{};
  double off = 0.0;
  constexpr int kSteps = 1000;  // of the cosine: the midpoint rule errs by its square
  constexpr int kTurns = 32;    // more than twice the degree: exact
  for (int i = 0; i < kSteps; ++i)
    for (int j = 0; j < kTurns; ++j) {
      const double z = -1.0 + (i + 0.5) * 2.0 / kSteps;
      const double turn = (j + 0.5) * 2.0 * std::acos(-1.0) / kTurns;
      const double s = std::sqrt(1.0 - z * z);
      const auto y = harmonics({s * std::cos(turn), s * std::sin(turn), z});
      const double area = 4.0 * std::acos(-1.0) / (kSteps * kTurns);
      for (std::size_t k = 0; k < kTransferTerms; ++k) diagonal[k] += area * y[k] * y[k];
      off += area * y[5] * y[20];
    }
  for (const double d : diagonal) EXPECT_NEAR(d, 1.0, 1e-3);
  EXPECT_NEAR(off, 0.0, 1e-9);
}

}  // namespace
}  // namespace opaline::sim
