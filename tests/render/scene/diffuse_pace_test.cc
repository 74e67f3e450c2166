// Automatic directions: when diffuse light is followed, and what stands for it until then.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "render/mesh/shapes.h"
#include "render/scene/scene_renderer.h"

namespace opaline::render {
namespace {

using Values = std::vector<std::array<float, 3>>;

Optics optics_of(double absorption) {
  Optics optics;
  optics.absorption.fill(absorption);
  optics.diffusion.fill(1.0 / (3.0 * (absorption + 0.8)));
  return optics;
}

/// Of radiance, relative.
double difference(const SurfaceLight& a, const SurfaceLight& b) {
  double error = 0.0;
  double size = 0.0;
  for (std::size_t v = 0; v < a.fluence.size(); ++v) {
    for (int c = 0; c < 3; ++c) {
      const double right = b.fluence[v][c] + 3.0 * b.net_flux[v][c];
      error += std::pow(a.fluence[v][c] + 3.0 * a.net_flux[v][c] - right, 2);
      size += right * right;
    }
  }
  return std::sqrt(error / size);
}

SurfaceLight sum(SurfaceLight a, const SurfaceLight& b) {
  for (std::size_t v = 0; v < a.fluence.size(); ++v) {
    for (int c = 0; c < 3; ++c) {
      a.fluence[v][c] += b.fluence[v][c];
      a.net_flux[v][c] += b.net_flux[v][c];
    }
  }
  return a;
}

constexpr double kSame = 1e-5;  // solutions are to 1e-8 and light is single precision

class DiffusePace : public ::testing::Test {
 protected:
  std::unique_ptr<Subsurface> made(int directions, double absorption = 0.01) {
    auto body = Subsurface::create(
        *solid_,
        [absorption](Vec3) { return optics_of(absorption); },
        1.3,
        {.directions = directions, .spacing_mm = 2.0, .interior_growth = 0.0, .tolerance = 1e-8},
        team_,
        {});
    EXPECT_TRUE(body);
    return *std::move(body);
  }
  static void light(Subsurface& body, const Values& environment, const Values& lamps, Pace pace) {
    ASSERT_TRUE(body.light({environment, lamps, pace}, {}, {}));
  }
  static Values lamp_from(const Subsurface& body, Vec3 towards) {
    Values q;
    for (const SurfacePlace& p : body.places()) {
      q.emplace_back().fill(static_cast<float>(std::max(0.0, dot(p.normal, normalized(towards)))));
    }
    return q;
  }
  static Values even(const Subsurface& body) { return {body.places().size(), {0.5F, 0.5F, 0.5F}}; }

  ThreadTeam team_{2};
  std::unique_ptr<SignedDistance> solid_ = *make_shape("torus", 20.0);
  static constexpr Vec3 kBefore{0.0, 0.0, 1.0};
  static constexpr Vec3 kAfter{0.5, 0.0, 1.0};
};

TEST_F(DiffusePace, AtRestAutomaticIsFourDirections) {
  const auto automatic = made(DiffusionOptions::kAutomatic);
  const auto four = made(4);
  const auto none = made(0);
  const Values lamps = lamp_from(*four, kBefore);
  for (Subsurface* body : {automatic.get(), four.get(), none.get()}) {
    light(*body, even(*body), lamps, Pace::kAtRest);
  }
  EXPECT_EQ(automatic->environment_entry(), DiffuseEntry::kFollowed);
  EXPECT_EQ(automatic->lamps_entry(), DiffuseEntry::kFollowed);
  EXPECT_FALSE(automatic->is_provisional());
  EXPECT_EQ(none->environment_entry(), DiffuseEntry::kAtSurface);
  EXPECT_LT(difference(automatic->lit(), four->lit()), kSame);
  EXPECT_GT(difference(none->lit(), four->lit()), 0.05);
}

TEST_F(DiffusePace, ALampThatTurnsEntersAtTheSurfaceAndTheEnvironmentStaysFollowed) {
  const auto body = made(DiffusionOptions::kAutomatic);
  const Values environment = even(*body);
  light(*body, environment, lamp_from(*body, kBefore), Pace::kAtRest);
  const Values turned = lamp_from(*body, kAfter);
  light(*body, environment, turned, Pace::kMoving);
  EXPECT_EQ(body->environment_entry(), DiffuseEntry::kFollowed);
  EXPECT_EQ(body->lamps_entry(), DiffuseEntry::kAtSurface);
  EXPECT_TRUE(body->is_provisional());
  const auto four = made(4);
  const auto none = made(0);
  light(*four, environment, {}, Pace::kAtRest);
  light(*none, {}, turned, Pace::kAtRest);
  EXPECT_LT(difference(body->lit(), sum(four->lit(), none->lit())), kSame);

  light(*body, environment, turned, Pace::kAtRest);
  light(*four, environment, turned, Pace::kAtRest);
  EXPECT_FALSE(body->is_provisional());
  EXPECT_LT(difference(body->lit(), four->lit()), kSame);
}

TEST_F(DiffusePace, AStrokeIsLitAsBeforeUntilItIsFollowed) {
  const auto body = made(DiffusionOptions::kAutomatic);
  const Values environment = even(*body);
  const Values lamps = lamp_from(*body, kBefore);
  light(*body, environment, lamps, Pace::kAtRest);
  ASSERT_TRUE(body->set_material([](Vec3) { return optics_of(0.02); }));
  light(*body, environment, lamps, Pace::kMoving);
  EXPECT_EQ(body->environment_entry(), DiffuseEntry::kFollowedBefore);
  EXPECT_EQ(body->lamps_entry(), DiffuseEntry::kFollowedBefore);
  EXPECT_TRUE(body->is_provisional());
  const auto painted = made(4, 0.02);
  const auto at_surface = made(0, 0.02);
  for (Subsurface* other : {painted.get(), at_surface.get()}) {
    light(*other, environment, lamps, Pace::kAtRest);
  }
  const double before = difference(body->lit(), painted->lit());
  EXPECT_GT(before, kSame);
  EXPECT_LT(before, 0.25 * difference(at_surface->lit(), painted->lit()));

  light(*body, environment, lamps, Pace::kAtRest);
  EXPECT_EQ(body->environment_entry(), DiffuseEntry::kFollowed);
  EXPECT_LT(difference(body->lit(), painted->lit()), kSame);
}

TEST_F(DiffusePace, WhatWasFollowedStaysWhenFollowingItAnewIsStopped) {
  const auto body = made(DiffusionOptions::kAutomatic);
  const Values environment = even(*body);
  light(*body, environment, {}, Pace::kAtRest);
  ASSERT_TRUE(body->set_material([](Vec3) { return optics_of(0.02); }));
  light(*body, environment, {}, Pace::kMoving);
  const SurfaceLight moving = body->lit();
  std::stop_source stop;
  stop.request_stop();
  EXPECT_FALSE(body->light({environment, {}, Pace::kAtRest}, {}, stop.get_token()));

  light(*body, environment, {}, Pace::kMoving);

  EXPECT_EQ(body->environment_entry(), DiffuseEntry::kFollowedBefore);
  EXPECT_LT(difference(body->lit(), moving), kSame);
}

TEST_F(DiffusePace, GivenDirectionsAreFollowedWhateverMoves) {
  const auto body = made(2);
  light(*body, even(*body), lamp_from(*body, kBefore), Pace::kAtRest);
  light(*body, even(*body), lamp_from(*body, kAfter), Pace::kMoving);
  EXPECT_EQ(body->lamps_entry(), DiffuseEntry::kFollowed);
  EXPECT_FALSE(body->is_provisional());
}

TEST_F(DiffusePace, ALatticeAndDarknessHaveNothingToFollow) {
  const auto body = made(DiffusionOptions::kAutomatic);
  light(*body, Values(body->places().size()), {}, Pace::kMoving);
  EXPECT_EQ(body->environment_entry(), DiffuseEntry::kDark);
  EXPECT_FALSE(body->is_provisional());
  const auto lattice = Subsurface::create(*solid_,
                                          [](Vec3) { return optics_of(0.01); },
                                          1.3,
                                          {.method = Discretisation::kPolygrid, .spacing_mm = 2.0},
                                          team_,
                                          {});
  ASSERT_TRUE(lattice);
  light(**lattice, even(**lattice), {}, Pace::kMoving);
  EXPECT_EQ((*lattice)->environment_entry(), DiffuseEntry::kAtSurface);
  EXPECT_FALSE((*lattice)->is_provisional());
}

/// A ring under an environment and a lamp.
Scene scene_with(Entry entry) {
  Scene scene;
  ObjectOptions ring;
  ring.name = "ring";
  ring.shape.name = "torus";
  ring.shape.size_mm = 20.0;
  scene.objects = {ring};
  scene.diffusion.entry = entry;
  scene.diffusion.spacing_mm = 2.0;
  scene.environment.radiance = {1.0, 1.0, 1.0};
  scene.lights = {{.name = "sun", .direction = {-0.4, -0.8, -0.9}}};
  return scene;
}

TEST(ScenePace, OnlyALampOfDiffuseEntryMakesATurnProvisional) {
  ThreadTeam team(2);
  for (const Entry entry : {Entry::kCollimated, Entry::kDiffuse}) {
    const Scene scene = scene_with(entry);
    const auto made = SceneRenderer::create(scene, team, [](std::string_view, double) {}, {});
    ASSERT_TRUE(made) << made.error().message;
    SceneRenderer& renderer = **made;
    ASSERT_TRUE(renderer.light(scene.lights, {}));
    auto turned = scene.lights;
    turned[0].direction = {0.4, -0.8, -0.9};
    ASSERT_TRUE(renderer.light(turned, Pace::kMoving, {}));
    const auto& object = renderer.statistics().objects[0];
    const bool is_diffuse = entry == Entry::kDiffuse;
    EXPECT_EQ(object.environment, DiffuseEntry::kFollowed);
    EXPECT_EQ(object.lamps, is_diffuse ? DiffuseEntry::kAtSurface : DiffuseEntry::kDark);
    EXPECT_EQ(renderer.is_provisional(), is_diffuse);
    ASSERT_TRUE(renderer.light(turned, {}));
    EXPECT_EQ(object.lamps, is_diffuse ? DiffuseEntry::kFollowed : DiffuseEntry::kDark);
    EXPECT_FALSE(renderer.is_provisional());
  }
}

TEST(ScenePace, ABendKeepsWhatTheEnvironmentWasUntilItRests) {
  ThreadTeam team(2);
  Scene scene = scene_with(Entry::kCollimated);
  DeformOptions deform;
  deform.kind = DeformOptions::Kind::kCage;
  deform.handles = {{.point = {2, -1, -1}, .move = {0.0, 0.0, 4.0}}};
  const auto made = SceneRenderer::create(scene, team, [](std::string_view, double) {}, {});
  ASSERT_TRUE(made) << made.error().message;
  SceneRenderer& renderer = **made;
  ASSERT_TRUE(renderer.light(scene.lights, {}));
  ASSERT_TRUE(renderer.bend(0, deform, {}));
  ASSERT_TRUE(renderer.light(scene.lights, Pace::kMoving, {}));
  EXPECT_EQ(renderer.statistics().objects[0].environment, DiffuseEntry::kFollowedBefore);
  EXPECT_TRUE(renderer.is_provisional());
  ASSERT_TRUE(renderer.light(scene.lights, {}));
  EXPECT_EQ(renderer.statistics().objects[0].environment, DiffuseEntry::kFollowed);
}

}  // namespace
}  // namespace opaline::render
