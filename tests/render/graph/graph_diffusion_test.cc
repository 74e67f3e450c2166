#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <string_view>

#include "render/graph/finite_elements.h"
#include "render/graph/quad_graph.h"
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
using reconstruct::diffusion::Termination;
using ::testing::HasSubstr;
using Light = std::function<double(Vec3)>;  // q by place

Boundary boundary() { return *make_boundary(BoundaryModel::kTwoMoment, 1.3); }

Optics optics(double scattering, double absorption) {
  Optics optics;
  optics.absorption.fill(absorption);
  optics.diffusion.fill(1.0 / (3.0 * (absorption + scattering)));
  return optics;
}

TetMesh stuffed(std::string_view shape, double size, double spacing) {
  const auto solid = make_shape(shape, size);
  auto mesh = stuff(**solid, {.spacing_mm = spacing}, {});
  EXPECT_TRUE(mesh);
  return pack(*mesh);
}

struct Solved {
  std::vector<Vec3> places;
  std::vector<double> areas;
  std::vector<double> q;
  SurfaceLight light;
  double absorbed = 0.0;
};

std::vector<std::array<float, 3>> light_at(const std::vector<Vec3>& places, const Light& light) {
  std::vector<std::array<float, 3>> q(places.size());
  for (std::size_t i = 0; i < q.size(); ++i) q[i].fill(static_cast<float>(light(places[i])));
  return q;
}

Solved solve_graph(const TetMesh& mesh, const std::vector<Optics>& material, const Light& light) {
  ThreadTeam team(2);
  const QuadGraph graph = make_quad_graph(mesh);
  TwoPoint<double> diffusion(graph, boundary());
  EXPECT_TRUE(diffusion.set_material(material));
  Solved solved;
  for (const auto& node : graph.surface) {
    solved.places.push_back(node.place);
    solved.areas.push_back(node.area);
  }
  const auto q = light_at(solved.places, light);
  for (const auto& value : q) solved.q.push_back(value[0]);
  LaneSolver<double> solver(diffusion.matrix(), {}, team);
  std::vector<Lanes<double>> b;
  diffusion.load(q, b);
  std::vector<Lanes<double>> phi(b.size(), Lanes<double>::zero());
  const auto summary = solver.solve(b, phi, {.tolerance = 1e-9, .max_iterations = 300}, {});
  EXPECT_EQ(summary.termination, Termination::kConverged) << summary.message;
  solved.light = diffusion.surface_light(q, phi);
  for (std::size_t i = 0; i < phi.size(); ++i) {
    solved.absorbed += graph.volumes[i] * material[i].absorption[0] * phi[i][0];
    EXPECT_GE(phi[i][0], 0.0);
  }
  return solved;
}

Solved solve_elements(const TetMesh& mesh,
                      const std::vector<Optics>& material,
                      const Light& light) {
  ThreadTeam team(2);
  const auto elements = FiniteElements::create(mesh, material, boundary());
  EXPECT_TRUE(elements);
  const auto q = light_at(mesh.vertices, light);
  LaneSolver<double> solver(elements->matrix(), {.first_rings = 1}, team);
  std::vector<Lanes<double>> phi(mesh.vertices.size(), Lanes<double>::zero());
  const auto summary =
      solver.solve(elements->load(q), phi, {.tolerance = 1e-9, .max_iterations = 300}, {});
  EXPECT_EQ(summary.termination, Termination::kConverged) << summary.message;
  Solved solved{mesh.vertices, elements->surface_areas(), {}, elements->surface_light(q, phi)};
  for (const auto& value : q) solved.q.push_back(value[0]);
  return solved;
}

/// Relative RMS error of the fluence over the surface.
double sphere_error(const Solved& solved, const LitSphere& exact, double radius) {
  double error = 0.0;
  double size = 0.0;
  for (std::size_t i = 0; i < solved.places.size(); ++i) {
    if (!(solved.areas[i] > 0.0)) continue;
    const double truth = exact.fluence(solved.places[i] * (radius / length(solved.places[i])));
    error += solved.areas[i] * std::pow(solved.light.fluence[i][0] - truth, 2);
    size += solved.areas[i] * truth * truth;
  }
  return std::sqrt(error / size);
}

TEST(QuadGraph, EveryInnerNodeHasFourLinksAndEverySurfaceNodeOne) {
  const TetMesh mesh = stuffed("torus", 20.0, 1.2);
  const QuadGraph graph = make_quad_graph(mesh);
  ASSERT_EQ(graph.links.size(), mesh.tets.size());
  std::vector<int> seen(graph.surface.size(), 0);
  for (std::size_t i = 0; i < graph.links.size(); ++i) {
    for (const auto& link : graph.links[i]) {
      ASSERT_NE(link.inner >= 0, link.surface >= 0);
      EXPECT_GT(link.reach, 0.0);
      if (link.surface >= 0) {
        ++seen[link.surface];
        EXPECT_EQ(graph.surface[link.surface].inner, static_cast<int>(i));
      } else {
        const auto& back = graph.links[link.inner];
        EXPECT_TRUE(std::ranges::any_of(
            back, [&](const auto& l) { return l.inner == static_cast<int>(i); }));
      }
    }
  }
  EXPECT_TRUE(std::ranges::all_of(seen, [](int n) { return n == 1; }));
}

TEST(QuadGraph, PackingKeepsTheMeshAndBringsNeighboursTogether) {
  const auto solid = make_shape("torus", 20.0);
  TetMesh mesh = *stuff(**solid, {.spacing_mm = 1.0}, {});
  TetMesh shuffled = mesh;
  for (std::size_t i = 0; i < mesh.tets.size(); ++i)
    std::swap(shuffled.tets[i], shuffled.tets[i * 7919 % mesh.tets.size()]);
  const auto spread = [](const TetMesh& m) {
    double sum = 0.0;
    const auto neighbours = neighbours_of(m);
    for (std::size_t t = 0; t < neighbours.size(); ++t) {
      for (const int n : neighbours[t]) sum += n >= 0 ? std::abs(n - static_cast<double>(t)) : 0.0;
    }
    return sum / static_cast<double>(neighbours.size());
  };
  const TetMesh packed = pack(shuffled);
  EXPECT_NEAR(quality_of(packed).volume, quality_of(mesh).volume, 1e-9);
  EXPECT_TRUE(validate(packed));
  EXPECT_LT(spread(packed), 0.1 * spread(shuffled));
}

// The bounds are the figures of docs/physics.md for another mesh of the same
// size.
TEST(GraphDiffusion, ALitSphereConvergesToTheExactSolution) {
  const Optics material = optics(1.0, 0.01);
  const LitSphere exact(10.0, material.diffusion[0], 0.01, boundary());
  struct Step {
    double tets, graph, elements;
  };
  for (const auto& [tets, graph_bound, elements_bound] :
       {Step{13e3, 0.011, 0.0015}, Step{52e3, 0.0075, 0.0006}}) {
    const TetMesh mesh = stuffed("sphere", 20.0, spacing_for(4188.79, tets));
    const std::vector<Optics> everywhere(mesh.tets.size(), material);
    EXPECT_LE(sphere_error(solve_graph(mesh, everywhere, LitSphere::irradiance), exact, 10.0),
              graph_bound);
    EXPECT_LE(sphere_error(solve_elements(mesh, everywhere, LitSphere::irradiance), exact, 10.0),
              elements_bound);
  }
}

TEST(GraphDiffusion, WhatEntersLeavesOrIsAbsorbed) {
  const TetMesh mesh = stuffed("figurine", 20.0, 1.0);
  std::vector<Optics> material;
  for (std::size_t t = 0; t < mesh.tets.size(); ++t) {
    material.push_back(optics(0.5 + 0.4 * std::sin(centroid_of(mesh, t).x),
                              0.02 + 0.01 * std::cos(centroid_of(mesh, t).z)));
  }
  const Solved solved = solve_graph(mesh, material, [](Vec3 p) { return std::max(p.y, 0.0); });
  double entered = 0.0;
  double net = 0.0;
  for (std::size_t s = 0; s < solved.q.size(); ++s) {
    entered += solved.areas[s] * solved.q[s];
    net += solved.areas[s] * solved.light.net_flux[s][0];
  }
  EXPECT_NEAR(net + solved.absorbed, 0.0,
              1e-6 * entered);  // net fluxes are answered as float
}

/// 16 x 16 x 2 mm.
class Plate final : public SignedDistance {
 public:
  double at(Vec3 p) const override {
    return std::max({std::abs(p.x) - 8.0, std::abs(p.y) - 8.0, std::abs(p.z) - 1.0});
  }
  Box bounds() const override { return {{-8.0, -8.0, -1.0}, {8.0, 8.0, 1.0}}; }
};

constexpr double kPlateSpacing = 0.5;
constexpr double kInterface =
    kPlateSpacing / 8.0;  // midway between two planes of the lattice's centroids

struct Transmitted {
  double power = 0.0;   // through the whole far side
  double middle = 0.0;  // mean exitance in its middle
};

/// Through a plate that q = 1 lights from below or above.
Transmitted transmitted(double below, double above, bool from_below) {
  const TetMesh mesh = pack(*stuff(Plate(), {.spacing_mm = kPlateSpacing}, {}));
  std::vector<Optics> material(mesh.tets.size());
  for (std::size_t t = 0; t < mesh.tets.size(); ++t) {
    material[t].diffusion.fill(centroid_of(mesh, t).z < kInterface ? below : above);
  }
  const double side = from_below ? -1.0 : 1.0;
  const Solved solved =
      solve_graph(mesh, material, [side](Vec3 p) { return p.z * side > 0.99 ? 1.0 : 0.0; });
  Transmitted through;
  double area = 0.0;
  for (std::size_t s = 0; s < solved.q.size(); ++s) {
    const Vec3 p = solved.places[s];
    if (p.z * side > -0.99) continue;
    const double power = solved.areas[s] * solved.light.net_flux[s][0];
    through.power += power;
    if (std::max(std::abs(p.x), std::abs(p.y)) > 1.5) continue;
    through.middle += power;
    area += solved.areas[s];
  }
  through.middle /= area;
  return through;
}

TEST(GraphDiffusion, TwoLayersPassTheSameLightBothWays) {
  const auto ideal = [](double below, double above) {  // in one dimension
    return boundary().source_scale /
           (4.0 * boundary().a + (1.0 + kInterface) / below + (1.0 - kInterface) / above);
  };
  const Transmitted up = transmitted(0.1, 0.4, true);
  EXPECT_NEAR(transmitted(0.1, 0.4, false).power / up.power, 1.0, 1e-3);
  // In one dimension, within what the rim takes and the cells across the interface smear: 2.5 % at this spacing. The
  // papers' weights are off by +114 and -47 % (docs/physics.md).
  EXPECT_NEAR(up.middle / ideal(0.1, 0.4), 1.0, 0.03);
  EXPECT_NEAR(transmitted(0.4, 0.1, true).middle / ideal(0.4, 0.1), 1.0, 0.03);
}

TEST(GraphDiffusion, GraphAndFiniteElementsAgreeOnAHeterogeneousTorus) {
  const TetMesh mesh = stuffed("torus", 20.0, 0.6);
  std::vector<Optics> material;
  for (std::size_t t = 0; t < mesh.tets.size(); ++t) {
    const Vec3 p = centroid_of(mesh, t);
    material.push_back(optics(1.0 + 0.8 * std::sin(p.x) * std::cos(p.y), 0.02));
  }
  const Light light = [](Vec3 p) { return std::max(p.x / length(p), 0.0); };
  const Solved graph = solve_graph(mesh, material, light);
  const Solved elements = solve_elements(mesh, material, light);
  const auto power = [](const Solved& solved) {
    double sum = 0.0;
    for (std::size_t s = 0; s < solved.q.size(); ++s)
      sum += solved.areas[s] * solved.light.fluence[s][0];
    return sum;
  };
  EXPECT_NEAR(power(graph) / power(elements), 1.0, 0.005);
}

// With lengths and kappa s times larger and sigma_a s times smaller the
// equation is the same.
TEST(GraphDiffusion, TheSameObjectAtAnotherScaleShinesTheSame) {
  std::vector<double> fluence;
  for (const double scale : {1e-3, 1.0, 1e2}) {  // 0.02 mm to 2 m
    const TetMesh mesh = stuffed("torus", 20.0 * scale, 1.2 * scale);
    Optics material;
    material.diffusion.fill(0.3 * scale);
    material.absorption.fill(0.02 / scale);
    const Solved solved = solve_graph(mesh,
                                      std::vector<Optics>(mesh.tets.size(), material),
                                      [scale](Vec3 p) { return p.x > 2.0 * scale ? 1.0 : 0.0; });
    double largest = 0.0;
    for (const auto& value : solved.light.fluence) largest = std::max<double>(largest, value[0]);
    fluence.push_back(largest);
  }
  EXPECT_NEAR(fluence[0] / fluence[1], 1.0, 1e-5);
  EXPECT_NEAR(fluence[2] / fluence[1], 1.0, 1e-5);
}

TEST(GraphDiffusion, ASingleTetrahedronASliverAndAThinSheetAreSolved) {
  const TetMesh single{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {{0, 1, 2, 3}}};
  const TetMesh sliver{{{0, 0, 0}, {1, 0, 0}, {1, 1, 1e-4}, {0, 1, 0}, {0.5, 0.5, 1}},
                       {{0, 1, 3, 2}, {0, 1, 2, 4}, {0, 2, 3, 4}}};
  for (const TetMesh& mesh : {single, sliver, stuffed("sheet", 20.0, 0.5)}) {
    ASSERT_TRUE(validate(mesh)) << validate(mesh).error().message;
    const Solved solved = solve_graph(
        mesh, std::vector<Optics>(mesh.tets.size(), optics(1.0, 0.01)), [](Vec3) { return 1.0; });
    for (const auto& fluence : solved.light.fluence) {
      EXPECT_GT(fluence[0], 0.0f);
      EXPECT_LE(fluence[0],
                boundary().source_scale * 1.0001);  // the maximum principle
    }
  }
}

TEST(GraphDiffusion, AContrastOfAMillionKeepsTheMaximumPrinciple) {
  const TetMesh mesh = stuffed("sphere", 20.0, 1.5);
  std::vector<Optics> material(mesh.tets.size(), optics(1.0, 0.0));
  for (std::size_t t = 0; t < mesh.tets.size(); ++t) {
    if (centroid_of(mesh, t).x > 0.0) material[t].diffusion.fill(1e6 / 3.0);
  }
  const Solved solved = solve_graph(mesh, material, [](Vec3 p) { return p.x < -3.0 ? 1.0 : 0.0; });
  for (const auto& fluence : solved.light.fluence) {
    EXPECT_GE(fluence[0], 0.0f);
    EXPECT_LE(fluence[0], boundary().source_scale * 1.0001);
  }
}

TEST(GraphDiffusion, MaterialThatMakesNoSenseIsRefusedWithItsPlace) {
  const TetMesh mesh{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {{0, 1, 2, 3}}};
  const QuadGraph graph = make_quad_graph(mesh);
  TwoPoint<float> diffusion(graph, boundary());
  std::vector<Optics> material(1, optics(1.0, 0.01));
  material[0].diffusion[2] = 0.0;
  EXPECT_THAT(diffusion.set_material(material).error().message, HasSubstr("place 0"));
  EXPECT_FALSE(diffusion.set_material({}));
  EXPECT_FALSE(FiniteElements::create(mesh, material, boundary()));
}

}  // namespace
}  // namespace opaline::render
