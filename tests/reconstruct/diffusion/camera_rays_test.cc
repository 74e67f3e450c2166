#include "reconstruct/diffusion/camera_rays.h"

#include <gtest/gtest.h>

#include <cmath>

#include "reconstruct/diffusion/camera_equation.h"
#include "reconstruct/diffusion/fresnel.h"
#include "reconstruct/diffusion/medium.h"

namespace opaline::reconstruct::diffusion {
namespace {

constexpr double kIor = 1.3;
constexpr double kScattering = 1.4;

Medium homogeneous(const Block& block, double absorption, const Boundary& boundary) {
  const std::size_t cells = block.cell_count();
  return make_medium(block,
                     {std::vector<double>(cells, absorption),
                      std::vector<double>(cells, kScattering - absorption)},
                     boundary);
}

// Depth of a cell's middle under face z_max.
double depth_of(const Block& block, int k) { return (block.nz - k - 0.5) * block.hz; }

struct View {
  double column;
  double row;
};

class FromAnyDirection : public testing::TestWithParam<View> {};

// A linear field that meets the boundary condition, phi_s = 2 A J_n: the P1 law is exact, whatever the cells' size and
// however few layers there are. Rounding is all that is left.
TEST_P(FromAnyDirection, SeesTheFieldOfP1WhereItIsLinearInDepth) {
  const Boundary boundary = *make_boundary(BoundaryModel::kTwoMoment, kIor);
  const auto [column, row] = GetParam();
  const double cosine = std::sqrt(1.0 - column * column - row * row);
  for (const int layers : {1, 3, 30}) {
    const Block block{5, 4, layers, 0.5, 0.7, 0.4};
    const Medium medium = homogeneous(block, 0.0, boundary);
    const double net_flux = 0.3;
    FieldBatch phi(block.cell_count(), 1);
    for (int k = 0; k < block.nz; ++k)
      for (int j = 0; j < block.ny; ++j)
        for (int i = 0; i < block.nx; ++i)
          phi.field(0)[block.index(i, j, k)] =
              net_flux * (2.0 * boundary.a + 3.0 * kScattering * depth_of(block, k));
    const std::vector<CameraRay> rays(20, camera_ray(kIor, column, row));
    std::vector<double> seen(20);
    CameraRays(medium, boundary, Face::kZMax, rays).gather(phi.field(0), {}, seen);
    const CameraEquation p1 = camera_equation(kIor, boundary, cosine);
    for (const double s : seen)
      EXPECT_NEAR(p1.source_gain * s, p1.radiance(0.0, net_flux), 1e-12) << layers << " layers";
  }
}

INSTANTIATE_TEST_SUITE_P(Directions,
                         FromAnyDirection,
                         testing::Values(View{0.0, 0.0}, View{0.34, 0.0}, View{-0.2, 0.6}));

// phi = e^(ax + by - cz) in a uniform medium, z the depth: along the ray x = X + z u, so
//   Phi = alpha' phi(X) sigma s / (sigma s + c - a u - b v),  s the stretch.
// What is linear between layers errs by (h (c - a u))^2 / 8 and less, and bilinear by (h a)^2 / 8: 0.2 % at h = 0.1.
TEST(CameraRays, FollowTheRefractedRayThroughASlopingField) {
  const Boundary boundary = *make_boundary(BoundaryModel::kTwoMoment, kIor);
  const double h = 0.1;
  const Block block{60, 60, 80, h, h, h};
  const double absorption = 0.2;
  const Medium medium = homogeneous(block, absorption, boundary);
  const double a = 0.5;
  const double b = -0.4;
  const double c = 0.9;
  FieldBatch phi(block.cell_count(), 1);
  for (int k = 0; k < block.nz; ++k)
    for (int j = 0; j < block.ny; ++j)
      for (int i = 0; i < block.nx; ++i)
        phi.field(0)[block.index(i, j, k)] =
            std::exp(a * (i + 0.5) * h + b * (j + 0.5) * h - c * depth_of(block, k));
  const CameraRay ray = camera_ray(kIor, 0.5, 0.3);
  EXPECT_NEAR(1.0 / ray.stretch, refracted_cosine(std::sqrt(1.0 - 0.34), kIor), 1e-12);
  const std::vector<CameraRay> rays(block.face_cell_count(Face::kZMax), ray);
  // A source that makes phi_s the field's value at the surface, without which phi_s would be 2 A J_n.
  const double share = 2.0 * boundary.a * boundary.conductance(h, medium.diffusion.front());
  std::vector<double> source(rays.size());
  std::vector<double> expected(rays.size());
  for (int j = 0; j < block.ny; ++j) {
    for (int i = 0; i < block.nx; ++i) {
      const auto x = static_cast<std::size_t>(j) * block.nx + i;
      const double surface = std::exp(a * (i + 0.5) * h + b * (j + 0.5) * h);
      source[x] = surface * (1.0 - share * std::exp(-c * 0.5 * h)) / (1.0 - share);
      const double through = kScattering * ray.stretch;
      expected[x] = (1.0 - absorption / kScattering) * surface * through /
                    (through + c - a * ray.column - b * ray.row);
    }
  }
  std::vector<double> seen(rays.size());
  CameraRays(medium, boundary, Face::kZMax, rays).gather(phi.field(0), source, seen);
  for (int j = 20; j < 40; ++j) {
    for (int i = 20; i < 40; ++i) {
      const auto x = static_cast<std::size_t>(j) * block.nx + i;
      EXPECT_NEAR(seen[x], expected[x], 2e-3 * expected[x]);
    }
  }
}

// The coefficients of another fluence: <g, W phi> = <W^T g, phi>, to rounding.
TEST(CameraRays, ScatterTransposesGather) {
  const Boundary boundary = *make_boundary(BoundaryModel::kTwoMoment, kIor);
  const Block block{6, 5, 7, 0.5, 0.6, 0.4};
  const Medium medium = homogeneous(block, 0.1, boundary);
  const std::vector<CameraRay> rays(block.face_cell_count(Face::kYMin),
                                    camera_ray(kIor, 0.4, -0.5));
  const CameraRays camera(medium, boundary, Face::kYMin, rays);
  FieldBatch phi(block.cell_count(), 1);
  for (std::size_t i = 0; i < phi.cells; ++i)
    phi.field(0)[i] = std::sin(1.0 + 3.0 * static_cast<double>(i));
  std::vector<double> g(rays.size());
  for (std::size_t x = 0; x < g.size(); ++x) g[x] = std::cos(2.0 + 5.0 * static_cast<double>(x));
  std::vector<double> seen(rays.size());
  camera.gather(phi.field(0), {}, seen);
  std::vector<double> back(phi.cells, 0.0);
  camera.scatter(g, back.data());
  double left = 0.0;
  double right = 0.0;
  for (std::size_t x = 0; x < g.size(); ++x) left += g[x] * seen[x];
  for (std::size_t i = 0; i < back.size(); ++i) right += back[i] * phi.field(0)[i];
  EXPECT_NEAR(left, right, 1e-12);
}

}  // namespace
}  // namespace opaline::reconstruct::diffusion
