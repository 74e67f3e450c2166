#include "render/trace/surface_picture.h"

#include <gmock/gmock.h>

#include <cmath>
#include <numbers>

#include "render/graph/two_point.h"
#include "render/mesh/shapes.h"
#include "render/solver/lane_solver.h"
#include "render/tetrahedra/stuffing.h"
#include "tests/render/graph/lit_sphere.h"

namespace opaline::render {
namespace {

using reconstruct::diffusion::Boundary;
using reconstruct::diffusion::BoundaryModel;
using reconstruct::diffusion::make_boundary;
using ::testing::HasSubstr;

constexpr double kRadius = 10.0;
constexpr double kIor = 1.3;
constexpr double kAbsorption = 0.01;
constexpr double kDiffusion = 1.0 / (3.0 * 1.01);

Boundary boundary() { return *make_boundary(BoundaryModel::kTwoMoment, kIor); }

CameraModel camera(int size) {
  CameraModel camera;
  camera.width = camera.height = size;
  camera.fx = camera.fy = 2.2 * size;
  camera.cx = camera.cy = 0.5 * size;
  camera.camera_from_sample = look_at({40, 20, 30}, {0, 0, 0}, {0, 0, 1});
  return camera;
}

struct LitMesh {
  TriangleMesh surface;
  SurfaceLight light;  // of its vertices
};

LitMesh solved_sphere(double tets) {
  const auto solid = make_shape("sphere", 2.0 * kRadius);
  const double spacing = spacing_for(estimate_volume(**solid), tets);
  const TetMesh mesh = *stuff(**solid, {.spacing_mm = spacing}, {});
  const QuadGraph graph = make_quad_graph(mesh);
  Optics optics;
  optics.absorption.fill(kAbsorption);
  optics.diffusion.fill(kDiffusion);
  TwoPoint<double> diffusion(graph, boundary());
  EXPECT_TRUE(diffusion.set_material(std::vector(graph.inner.size(), optics)));
  std::vector<std::array<float, 3>> q(graph.surface.size());
  for (std::size_t s = 0; s < q.size(); ++s) {
    q[s].fill(static_cast<float>(LitSphere::irradiance(graph.surface[s].place)));
  }
  std::vector<Lanes<double>> b;
  diffusion.load(q, b);
  ThreadTeam team(1);
  std::vector<Lanes<double>> phi(b.size(), Lanes<double>::zero());
  LaneSolver<double>(diffusion.matrix(), {}, team).solve(b, phi, {.tolerance = 1e-6}, {});
  const TriangleMesh surface = surface_mesh(mesh);
  EXPECT_EQ(surface.triangles.size(), graph.surface.size());
  return {surface, at_vertices(surface, diffusion.surface_light(q, phi))};
}

/// What the exact solution shows at a pixel: the sphere met by a quadratic equation, Fresnel by amplitudes.
double exact_radiance(const CameraModel& camera, double x, double y) {
  static const LitSphere sphere(kRadius, kDiffusion, kAbsorption, boundary());
  const Vec3 o = camera.centre();
  const Vec3 d = normalized(camera.ray_direction({x, y}));
  const double nearest = -dot(o, d);
  const double square = kRadius * kRadius - dot(o, o) + nearest * nearest;
  if (square < 0.0) return 0.0;
  const Vec3 p = o + d * (nearest - std::sqrt(square));
  const double mu = -dot(p, d) / kRadius;
  const double inside = std::sqrt(1.0 - (1.0 - mu * mu) / (kIor * kIor));
  const double s = 2.0 * mu / (mu + kIor * inside);
  const double t = 2.0 * mu / (kIor * mu + inside);
  const double passed = 0.5 * kIor * inside / mu * (s * s + t * t);
  const double phi = sphere.fluence(p);
  const double source = boundary().source_scale * LitSphere::irradiance(p);
  const double flux = (phi - source) / (2.0 * boundary().a);
  return passed / (4.0 * std::numbers::pi * kIor * kIor) * (phi + 3.0 * inside * flux);
}

/// Relative RMS over the pixels that the mesh covers.
double picture_error(double tets) {
  const LitMesh lit = solved_sphere(tets);
  const CameraModel view = camera(96);
  ThreadTeam team(2);
  const auto picture = draw_surface(lit.surface, lit.light, view, {.ior = kIor}, team, {});
  EXPECT_TRUE(picture);
  double error = 0.0;
  double size = 0.0;
  for (int y = 0; y < view.height; ++y) {
    for (int x = 0; x < view.width; ++x) {
      if (picture->at(x, y, 3) < 1.0F) continue;
      const double truth = exact_radiance(view, x + 0.5, y + 0.5);
      error += std::pow(picture->at(x, y, 1) - truth, 2);
      size += truth * truth;
    }
  }
  return std::sqrt(error / size);
}

TEST(SurfacePictureTest, ASphereShowsTheRadianceOfTheExactSolution) {
  const double coarse = picture_error(3'000);
  const double fine = picture_error(13'000);
  RecordProperty("relative_rms_13k", std::to_string(fine));
  EXPECT_LT(fine, 0.02);  // the renderer's goal for surface radiance
  EXPECT_LT(fine, coarse);
}

TEST(SurfacePictureTest, CoverageIsTheSphereSeenFromTheCamera) {
  const LitMesh lit = solved_sphere(13'000);
  const CameraModel view = camera(128);
  ThreadTeam team(2);
  const auto picture =
      draw_surface(lit.surface, lit.light, view, {.ior = kIor, .samples_per_axis = 2}, team, {});
  ASSERT_TRUE(picture);
  double covered = 0.0;
  for (int y = 0; y < view.height; ++y)
    for (int x = 0; x < view.width; ++x) covered += picture->at(x, y, 3);
  const double distance = length(view.centre());
  const double tangent = kRadius / std::sqrt(distance * distance - kRadius * kRadius);
  const double disk = std::numbers::pi * std::pow(view.fx * tangent, 2);
  // Chords of one spacing, about 1.5 mm, lie up to 1.5^2 / 8 / 10 mm within the sphere: 0.3 % of its radius, 0.6 % of the disk.
  EXPECT_NEAR(covered / disk, 1.0, 0.01);
}

TEST(SurfacePictureTest, ThreadsDoNotChangeThePicture) {
  const LitMesh lit = solved_sphere(3'000);
  ThreadTeam one(1);
  ThreadTeam three(3);
  const auto a = draw_surface(lit.surface, lit.light, camera(40), {}, one, {});
  const auto b = draw_surface(lit.surface, lit.light, camera(40), {}, three, {});
  ASSERT_TRUE(a && b);
  EXPECT_EQ(*a, *b);
  EXPECT_GT(a->at(20, 20, 3), 0.0F);
}

TEST(SurfacePictureTest, RefusesLightOfAnotherShapeAndStopsWhenAsked) {
  LitMesh lit = solved_sphere(3'000);
  ThreadTeam team(1);
  std::stop_source stop;
  stop.request_stop();
  const auto stopped = draw_surface(lit.surface, lit.light, camera(8), {}, team, stop.get_token());
  ASSERT_FALSE(stopped);
  EXPECT_EQ(stopped.error().code, ErrorCode::kCancelled);
  lit.light.fluence.pop_back();
  const auto refused = draw_surface(lit.surface, lit.light, camera(8), {}, team, {});
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().message, HasSubstr("one value a vertex"));
}

}  // namespace
}  // namespace opaline::render
