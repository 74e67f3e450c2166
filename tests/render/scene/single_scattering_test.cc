#include "render/scene/single_scattering.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <numbers>

#include "render/mesh/shapes.h"
#include "render/scene/lighting.h"
#include "render/scene/subsurface.h"
#include "sim/fresnel.h"

namespace opaline::render {
namespace {

const Vec3 kTowards = normalized(Vec3{0.3, 0.0, 1.0});

struct Matter {
  double scattering = 0.5;
  double absorption = 0.0;
  double ior = 1.3;

  double entering(double cosine) const {
    return cosine > 0.0 ? cosine * (1.0 - sim::reflectance(std::min(1.0, cosine), 1.0, ior)) : 0.0;
  }
  double inside(double cosine) const {
    return std::sqrt(1.0 - (1.0 - cosine * cosine) / (ior * ior));
  }
};

/// A ball, 20 mm across, in light from one direction, what was scattered once kept apart.
class LitBall {
 public:
  explicit LitBall(const Matter& matter) : matter_(matter) {
    auto body = Subsurface::create(
        *solid_,
        [matter](Vec3) {
          Optics optics;
          optics.absorption.fill(matter.absorption);
          optics.diffusion.fill(1.0 / (3.0 * (matter.absorption + matter.scattering)));
          return optics;
        },
        matter_.ior,
        {.single_scattering = true, .spacing_mm = 1.25, .tolerance = 1e-8},
        team_,
        {});
    EXPECT_TRUE(body);
    body_ = *std::move(body);
    std::vector<Beam> beams;
    for (std::size_t f = 0; f < faces().size(); ++f) {
      const double q = faces()[f].area * matter.entering(dot(faces()[f].middle.normal, kTowards));
      if (!(q > 0.0)) continue;
      entered_ += q;
      beams.push_back({static_cast<int>(f),
                       refracted(kTowards, faces()[f].middle.normal, matter_.ior),
                       {q, q, q}});
    }
    const std::vector<std::array<float, 3>> dark(body_->places().size());
    EXPECT_TRUE(body_->light(dark, beams, {}));
    drawn_ = std::make_unique<DrawnSurface>(body_->surface(), *solid_, 1);
    surfaces_.add(drawn_->mesh(), drawn_->normals());
    EXPECT_TRUE(surfaces_.build());
    once_ = std::make_unique<SingleScattering>(
        *body_->beams(), body_->surface(), *drawn_, surfaces_, lamps_, matter_.ior);
  }

  const std::vector<BeamDeposit::Face>& faces() const { return body_->beams()->faces(); }
  const Subsurface& body() const { return *body_; }
  const Surfaces& surfaces() const { return surfaces_; }
  const SingleScattering& once() const { return *once_; }
  double entered() const { return entered_; }
  /// W that leave by diffusion.
  double diffused() const {
    double sum = 0.0;
    for (std::size_t f = 0; f < faces().size(); ++f) {
      for (const int v : body_->surface().triangles[f]) {
        sum += faces()[f].area * body_->lit().net_flux[v][0] / 3.0;
      }
    }
    return sum;
  }
  double left_once() const {
    double sum = 0.0;
    for (const auto& power : body_->passed_once()) sum += power[0];
    return sum;
  }
  /// The same of what is seen: int Phi_1 F_t / (4 pi eta^2) cos dw over the surface.
  double seen_once() const {
    const std::vector<Vec3> directions = cosine_directions(8);
    double sum = 0.0;
    for (std::size_t f = 0; f < faces().size(); ++f) {
      const SurfacePlace& middle = faces()[f].middle;
      const Frame frame = frame_around(middle.normal);
      for (const Vec3& d : directions) {
        const double passes = 1.0 - sim::reflectance(d.z, 1.0, matter_.ior);
        const Vec3 along = refracted(frame.to_scene(d), middle.normal, matter_.ior);
        sum += faces()[f].area * passes * once_->seen(4 * f, middle.place, along)[0] /
               (4.0 * matter_.ior * matter_.ior * static_cast<double>(directions.size()));
      }
    }
    return sum;
  }

 private:
  Matter matter_;
  std::unique_ptr<SignedDistance> solid_ = *make_shape("sphere", 20.0);
  ThreadTeam team_{2};
  std::unique_ptr<Subsurface> body_;
  std::unique_ptr<DrawnSurface> drawn_;
  Surfaces surfaces_;
  std::vector<LightOptions> lamps_{{.direction = kTowards * -1.0, .irradiance = {1.0, 1.0, 1.0}}};
  std::unique_ptr<SingleScattering> once_;
  double entered_ = 0.0;
};

// Chandrasekhar, Radiative Transfer, 1960, first order: Phi_1 = alpha' q / (mu + mu_0). A ball of 50 mean free paths' radius differs by
// about one path over it.
TEST(SingleScattering, IsThatOfAHalfSpaceOnADenseBall) {
  const Matter matter{.scattering = 4.8, .absorption = 0.2};
  const LitBall ball(matter);
  const auto hit = ball.surfaces().nearest({Vec3{0.1, 0.05, 30.0}, {0.0, 0.0, -1.0}});
  ASSERT_TRUE(hit);
  const double lit = dot(hit->normal, kTowards);
  for (const double degrees : {0.0, 30.0, 60.0, 80.0}) {
    const double angle = degrees * std::numbers::pi / 180.0;
    const Vec3 view{0.0, std::sin(angle), std::cos(angle)};
    const double expected =
        0.96 * matter.entering(lit) / (matter.inside(dot(hit->normal, view)) + matter.inside(lit));
    const double found =
        ball.once().seen(hit->triangle, hit->place, refracted(view, hit->normal, matter.ior))[1];
    EXPECT_NEAR(found, expected, 0.03 * expected) << degrees;
  }
}

// Followed outwards from where it was scattered, and seen along rays: two ways to add up the same light. Matched index: what a ball gathers
// of its beams is not seen.
TEST(SingleScattering, ShowsTheLightThatLeftTheDiffusion) {
  const LitBall ball({.ior = 1.0});
  EXPECT_NEAR(ball.seen_once(), ball.left_once(), 0.03 * ball.left_once());
}

TEST(SingleScattering, LosesNoLight) {
  const LitBall ball({});
  EXPECT_GT(ball.left_once(), 0.05 * ball.entered());
  EXPECT_NEAR(ball.left_once() + ball.diffused(), ball.entered(), 1e-3 * ball.entered());
}

}  // namespace
}  // namespace opaline::render
