#include "bench/render/sphere_error.h"

#include <cmath>
#include <type_traits>

#include "base/ensure.h"
#include "bench/render/render_case.h"
#include "render/graph/finite_elements.h"
#include "render/graph/leaning_links.h"
#include "render/graph/polygrid.h"
#include "tests/render/graph/lit_sphere.h"

namespace opaline::bench {
namespace {

using render::Lanes;
using render::LitSphere;

constexpr double kRadius = 10.0;
constexpr reconstruct::diffusion::SolveOptions kExact{.tolerance = 1e-8, .max_iterations = 300};

/// Adds up the error of one value after another.
class SphereError {
 public:
  void add(Vec3 place, double fluence, double area) {
    const double truth = exact_.fluence(place * (kRadius / length(place)));
    error_ += area * (fluence - truth) * (fluence - truth);
    size_ += area * truth * truth;
  }
  double relative() const { return std::sqrt(error_ / size_); }

 private:
  LitSphere exact_{
      kRadius, plain_optics().diffusion[0], plain_optics().absorption[0], render_boundary()};
  double error_ = 0.0;
  double size_ = 0.0;
};

std::array<float, 3> light(Vec3 place) {
  const auto q = static_cast<float>(length(place) > 0.0 ? LitSphere::irradiance(place) : 0.0);
  return {q, q, q};
}

template <class Graph>
double two_point_error(const Graph& graph,
                       const render::TetMesh& mesh,
                       int corrections,
                       ThreadTeam& team) {
  render::TwoPoint<double, Graph> diffusion(graph, render_boundary());
  ENSURE(diffusion.set_material(std::vector(graph.inner.size(), plain_optics())).has_value());
  std::vector<std::array<float, 3>> q;
  q.reserve(graph.surface.size());
  for (const auto& node : graph.surface) q.push_back(light(node.place));
  std::vector<Lanes<double>> b;
  diffusion.load(q, b);
  std::vector<Lanes<double>> phi(b.size(), Lanes<double>::zero());
  render::LaneSolver<double> solver(diffusion.matrix(), {}, team);
  const auto solve = [&](const auto& load, double tolerance) {
    return solver.solve(
        load, phi, {.tolerance = tolerance, .max_iterations = kExact.max_iterations}, {});
  };
  render::SurfaceLight out;
  if constexpr (std::is_same_v<Graph, render::QuadGraph>) {
    render::LeaningLinks<double> lean(mesh, graph, render_boundary(), team);
    lean.update(std::vector(graph.inner.size(), plain_optics()));
    lean.settle(q, b, phi, kExact.tolerance, corrections, solve);
    out = diffusion.surface_light(q, phi, lean.at_surface());
  } else {
    solve(b, kExact.tolerance);
    out = diffusion.surface_light(q, phi);
  }
  SphereError error;
  for (std::size_t s = 0; s < q.size(); ++s) {
    error.add(graph.surface[s].place, out.fluence[s][0], graph.surface[s].area);
  }
  return error.relative();
}

}  // namespace

double graph_error(const render::TetMesh& sphere, int corrections, ThreadTeam& team) {
  return two_point_error(render::make_quad_graph(sphere), sphere, corrections, team);
}

double polygrid_error(const render::SignedDistance& sphere, double spacing, ThreadTeam& team) {
  const auto grid = render::make_polygrid(sphere, spacing, 0.0, {});
  ENSURE(grid.has_value());
  return two_point_error(*grid, {}, 0, team);
}

double elements_error(const render::TetMesh& sphere, ThreadTeam& team) {
  const auto elements = render::FiniteElements::create(
      sphere, std::vector(sphere.tets.size(), plain_optics()), render_boundary());
  ENSURE(elements.has_value());
  std::vector<std::array<float, 3>> q;
  q.reserve(sphere.vertices.size());
  for (const Vec3& place : sphere.vertices) q.push_back(light(place));
  std::vector<Lanes<double>> phi(q.size(), Lanes<double>::zero());
  render::LaneSolver<double>(elements->matrix(), {.first_rings = 1}, team)
      .solve(elements->load(q), phi, kExact, {});
  SphereError error;
  for (std::size_t v = 0; v < q.size(); ++v) {
    const double area = elements->surface_areas()[v];
    if (area > 0.0) error.add(sphere.vertices[v], phi[v][0], area);
  }
  return error.relative();
}

}  // namespace opaline::bench
