#include "bench/render/render_case.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <numbers>

#include "base/log.h"
#include "render/mesh/shapes.h"
#include "render/solver/large_pages.h"
#include "render/tetrahedra/stuffing.h"

namespace opaline::bench {
namespace {

using reconstruct::diffusion::SolveSummary;
using render::Lanes;
using render::Optics;

[[noreturn]] void give_up(const Error& error) {
  log::error("{}", error.message);
  std::exit(1);
}

std::vector<Optics> marbled(const render::QuadGraph& graph) {
  std::vector<Optics> optics;
  optics.reserve(graph.inner.size());
  for (const Vec3& place : graph.inner) optics.push_back(marbled_optics(place));
  return optics;
}

}  // namespace

reconstruct::diffusion::Boundary render_boundary() {
  return *make_boundary(reconstruct::diffusion::BoundaryModel::kTwoMoment, 1.3);
}

Optics plain_optics() {
  Optics optics;
  optics.absorption.fill(0.01);
  optics.diffusion.fill(1.0 / (3.0 * 1.01));
  return optics;
}

Optics marbled_optics(Vec3 p) {
  constexpr std::array kAbsorption{0.01, 0.03, 0.1};
  const double vein = 0.5 + 0.5 * std::sin(1.3 * p.x) * std::sin(1.1 * p.y) * std::sin(0.9 * p.z);
  Optics optics;
  for (int c = 0; c < 3; ++c) {
    optics.absorption[c] = kAbsorption[c] * (0.3 + vein);
    optics.diffusion[c] = 1.0 / (3.0 * (optics.absorption[c] + 0.5 + 1.5 * vein));
  }
  return optics;
}

std::unique_ptr<render::SignedDistance> shape(std::string_view name) {
  auto solid = render::make_shape(name, 20.0);
  if (!solid) give_up(solid.error());
  return *std::move(solid);
}

render::TetMesh cut(const render::SignedDistance& solid, double tets, double interior_growth) {
  const double spacing = render::spacing_for(render::estimate_volume(solid), tets);
  const auto mesh =
      render::stuff(solid, {.spacing_mm = spacing, .interior_growth = interior_growth}, {});
  if (!mesh) give_up(mesh.error());
  return render::pack(*mesh);
}

std::array<float, 3> light_around(const render::QuadGraph::SurfaceNode& node, double degrees) {
  const double angle = degrees * std::numbers::pi / 180.0;
  const Vec3 towards = normalized({std::cos(angle), 0.8 * std::sin(angle), 0.6 * std::sin(angle)});
  const auto q = static_cast<float>(std::max(0.0, dot(node.normal, towards)));
  return {q, q, q};
}

LitObject::LitObject(const render::TetMesh& mesh, ThreadTeam& team, int remembered)
    : graph_(render::make_quad_graph(mesh)),
      optics_(marbled(graph_)),
      diffusion_(graph_, render_boundary()),
      q_(graph_.surface.size()),
      phi_(render::large_vector(graph_.inner.size(), Lanes<float>::zero())) {
  if (auto taken = diffusion_.set_material(optics_); !taken) give_up(taken.error());
  solver_ = std::make_unique<render::LaneSolver<float>>(
      diffusion_.matrix(), render::HierarchyOptions{}, team, remembered);
}

SolveSummary LitObject::frame(double degrees, double tolerance, bool cold) {
  for (std::size_t s = 0; s < q_.size(); ++s) q_[s] = light_around(graph_.surface[s], degrees);
  if (cold) {
    solver_->forget();
    std::ranges::fill(phi_, Lanes<float>::zero());
  }
  diffusion_.load(q_, b_);
  SolveSummary summary =
      solver_->solve(b_, phi_, {.tolerance = tolerance, .max_iterations = 200}, {});
  static_cast<void>(diffusion_.surface_light(q_, phi_));
  return summary;
}

void LitObject::paint(Vec3 place, double factor) {
  for (std::size_t i = 0; i < optics_.size(); ++i) {
    if (length(graph_.inner[i] - place) > 4.0) continue;
    for (double& absorption : optics_[i].absorption) absorption *= factor;
  }
  if (auto taken = diffusion_.set_material(optics_); !taken) give_up(taken.error());
  solver_->matrix_changed();
}

}  // namespace opaline::bench
