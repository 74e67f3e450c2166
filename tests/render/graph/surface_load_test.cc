// How light that falls on a surface becomes the load of finite elements.

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <optional>

#include "render/graph/finite_elements.h"
#include "render/graph/quad_graph.h"
#include "render/mesh/shapes.h"
#include "render/tetrahedra/stuffing.h"

namespace opaline::render {
namespace {

using reconstruct::diffusion::BoundaryModel;
using reconstruct::diffusion::make_boundary;
using Light = std::function<double(Vec3)>;  // q by place
using Values = std::vector<std::array<float, 3>>;

class SurfaceLoad : public ::testing::Test {
 protected:
  SurfaceLoad() {
    const auto solid = make_shape("sphere", 20.0);
    mesh_ = pack(*stuff(**solid, {.spacing_mm = 2.5}, {}));
    Optics optics;
    optics.absorption.fill(0.01);
    optics.diffusion.fill(0.3);
    elements_.emplace(
        *FiniteElements::create(mesh_, std::vector(mesh_.tets.size(), optics), boundary_));
  }

  Values at_vertices(const Light& light) const {
    Values q(mesh_.vertices.size());
    for (std::size_t v = 0; v < q.size(); ++v)
      q[v].fill(static_cast<float>(light(mesh_.vertices[v])));
    return q;
  }
  /// The load of light that is known at the vertices and in the middles of the surface's edges.
  std::vector<Lanes<double>> with_middles(const Light& light) const {
    Values q = at_vertices(light);
    const auto first = static_cast<int>(q.size());
    for (const auto& [a, b] : elements_->surface_edges())
      q.emplace_back().fill(
          static_cast<float>(light((mesh_.vertices[a] + mesh_.vertices[b]) * 0.5)));
    std::vector<std::array<int, 6>> places;
    const auto triangles = surface_of(mesh_);
    for (std::size_t t = 0; t < triangles.size(); ++t) {
      const auto& [i, j, k] = triangles[t];
      const auto& [ij, jk, ki] = elements_->edges_of_triangles()[t];
      places.push_back({i, j, k, first + ij, first + jk, first + ki});
    }
    return elements_->load(q, places);
  }
  /// S / (2 A) int q v over each triangle, by the middles of many small ones.
  std::vector<double> truth(const Light& light) const {
    constexpr int kParts = 40;
    std::vector<double> sums(mesh_.vertices.size(), 0.0);
    for (const auto& t : surface_of(mesh_)) {
      const Vec3 a = mesh_.vertices[t[0]];
      const Vec3 b = mesh_.vertices[t[1]];
      const Vec3 c = mesh_.vertices[t[2]];
      const double part = 0.5 * length(cross(b - a, c - a)) / (kParts * kParts) *
                          boundary_.source_scale / (2.0 * boundary_.a);
      for (int i = 0; i < kParts; ++i) {
        for (int k = 0; k < 2 * (kParts - i) - 1; ++k) {
          const double along = (i + (k % 2 == 0 ? 1.0 : 2.0) / 3.0) / kParts;
          const int pair = k / 2;
          const double across = (pair + (k % 2 == 0 ? 1.0 : 2.0) / 3.0) / kParts;
          const double q = light(a + (b - a) * along + (c - a) * across) * part;
          sums[t[0]] += q * (1.0 - along - across);
          sums[t[1]] += q * along;
          sums[t[2]] += q * across;
        }
      }
    }
    return sums;
  }
  static double difference(const std::vector<Lanes<double>>& load,
                           const std::vector<double>& truth) {
    double off = 0.0;
    double all = 0.0;
    for (std::size_t v = 0; v < truth.size(); ++v) {
      off += std::pow(load[v][0] - truth[v], 2);
      all += truth[v] * truth[v];
    }
    return std::sqrt(off / all);
  }

  TetMesh mesh_;
  reconstruct::diffusion::Boundary boundary_ = *make_boundary(BoundaryModel::kTwoMoment, 1.3);
  std::optional<FiniteElements> elements_;
};

TEST_F(SurfaceLoad, LinearLightIsExactWithAndWithoutMiddles) {
  const Light linear = [](Vec3 p) { return 2.0 + 0.1 * p.x - 0.05 * p.y; };
  const auto exact = truth(linear);
  // The light is single precision, and the small triangles' sum is off by 1 / (4 parts^2).
  EXPECT_LT(difference(elements_->load(at_vertices(linear)), exact), 2e-4);
  EXPECT_LT(difference(with_middles(linear), exact), 2e-4);
}

TEST_F(SurfaceLoad, AKinkAndACurveAreOffByAQuarterWithTheMiddles) {
  for (const Light& light : {Light([](Vec3 p) { return std::max(0.0, p.x + 0.7 * p.y + 0.3); }),
                             Light([](Vec3 p) { return 10.0 + 0.1 * p.x * p.x; })}) {
    const auto exact = truth(light);
    const double without = difference(elements_->load(at_vertices(light)), exact);
    const double with = difference(with_middles(light), exact);
    EXPECT_GT(without, 2e-3);
    EXPECT_LT(with, 0.35 * without);  // of second order on half the length: 1/4, and the sum's own
  }
}

}  // namespace
}  // namespace opaline::render
