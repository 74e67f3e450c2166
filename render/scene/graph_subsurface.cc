#include <algorithm>
#include <cmath>

#include "render/graph/leaning_links.h"
#include "render/graph/nearest.h"
#include "render/graph/published_weights.h"
#include "render/graph/two_point.h"
#include "render/scene/fresh_hierarchy.h"
#include "render/scene/subsurface_methods.h"
#include "render/solver/large_pages.h"
#include "render/trace/vertex_values.h"

namespace opaline::render {
namespace {

using reconstruct::diffusion::Boundary;
using reconstruct::diffusion::SolveSummary;

constexpr int kNearest = 4;
constexpr double kSinglePrecision = 1e-5;  // of the residual; below it numbers are double

/// Diffusion: TwoPoint<T, Graph>, or PublishedWeights<T>, whose unknowns are kappa phi.
template <class T, class Graph, class Diffusion>
class GraphSubsurface final : public Subsurface {
 public:
  GraphSubsurface(Graph graph, TetMesh mesh, const SubsurfaceSetting& setting)
      : Subsurface(std::move(mesh), setting.options),
        graph_(std::move(graph)),
        boundary_(setting.boundary),
        diffusion_(graph_, boundary_),
        phi_(large_vector(graph_.inner.size(), Lanes<T>::zero())) {}

  Result<void> begin_with(const SubsurfaceSetting& setting) {
    if constexpr (kMayLean) {
      if (options_.corrections > 0)
        lean_ = std::make_unique<LeaningLinks<T>>(mesh_, graph_, boundary_, setting.team);
    }
    if (auto begun = begin(setting); !begun) return begun;
    solver_ =
        std::make_unique<FreshHierarchy<T>>(diffusion_.matrix(), HierarchyOptions{}, setting.team);
    if constexpr (kIsLattice) {
      std::vector<Vec3> places;
      for (const auto& node : graph_.surface) places.push_back(node.place);
      to_vertices_ = nearest_interpolation(
          places, surface().vertices, std::min<int>(kNearest, static_cast<int>(places.size())));
    }
    return ok();
  }

 protected:
  Result<void> assemble() override {
    if constexpr (!kIsLattice) update_geometry(mesh_, graph_);
    auto taken = diffusion_.set_material(optics_);
    if (taken && solver_) solver_->matrix_changed();
    if (taken && lean_) lean_->update(optics_);
    return taken;
  }

  std::vector<Vec3> nodes() const override { return graph_.inner; }

  std::vector<SurfacePlace> flat_places() const override {
    std::vector<SurfacePlace> places;
    places.reserve(graph_.surface.size());
    for (const auto& node : graph_.surface) {
      places.push_back({node.place, node.normal, std::sqrt(2.0 * node.area)});
    }
    return places;
  }

  DepositAt deposit_at() const override { return DepositAt::kTetrahedra; }

  SolveSummary solve(std::span<const std::array<float, 3>> q,
                     std::span<const std::array<double, 3>> scattered,
                     std::stop_token stop) override {
    diffusion_.load(q, load_);
    for (std::size_t i = 0; i < scattered.size(); ++i) {
      for (int c = 0; c < 3; ++c) {
        const double more = diffusion_.load_of_power(i) * scattered[i][c];
        load_[i].set(c, load_[i][c] + static_cast<T>(more));
      }
    }
    const auto solve = [&](const std::vector<Lanes<T>>& load, double tolerance) {
      auto options = solve_options();
      options.tolerance = tolerance;
      return solver_->solve(load, phi_, options, stop);
    };
    return lean_ ? lean_->settle(q, load_, phi_, options_.tolerance, options_.corrections, solve)
                 : solve(load_, options_.tolerance);
  }

  SurfaceLight at_surface(std::span<const std::array<float, 3>> q) const override {
    const SurfaceLight light = light_of(q);
    if constexpr (kIsLattice) {
      return {interpolated(light.fluence), interpolated(light.net_flux)};
    } else {
      return at_vertices(surface(), light);
    }
  }

 private:
  static constexpr bool kIsLattice = std::is_same_v<Graph, Polygrid>;
  static constexpr bool kMayLean = std::is_same_v<Diffusion, TwoPoint<T, QuadGraph>>;

  SurfaceLight light_of(std::span<const std::array<float, 3>> q) const {
    if constexpr (kMayLean) {
      if (lean_) return diffusion_.surface_light(q, phi_, lean_->at_surface());
    }
    return diffusion_.surface_light(q, phi_);
  }

  Values interpolated(const Values& of_nodes) const {
    Values values(surface().vertices.size());
    for (int v = 0; v < to_vertices_.rows(); ++v) {
      for (int e = to_vertices_.starts[v]; e < to_vertices_.starts[v + 1]; ++e) {
        for (int c = 0; c < 3; ++c) {
          values[v][c] += to_vertices_.weights[e] * of_nodes[to_vertices_.columns[e]][c];
        }
      }
    }
    return values;
  }

  Graph graph_;
  Boundary boundary_;
  Diffusion diffusion_;
  std::unique_ptr<FreshHierarchy<T>> solver_;
  std::unique_ptr<LeaningLinks<T>> lean_;  // none: as two points have it
  std::vector<Lanes<T>> load_;
  std::vector<Lanes<T>> phi_;
  Interpolation<float> to_vertices_;
};

template <class T, class Diffusion, class Graph>
Result<std::unique_ptr<Subsurface>> made_of(Graph graph,
                                            TetMesh mesh,
                                            const SubsurfaceSetting& setting) {
  auto made = std::make_unique<GraphSubsurface<T, Graph, Diffusion>>(
      std::move(graph), std::move(mesh), setting);
  if (auto begun = made->begin_with(setting); !begun) return begun.error();
  return std::unique_ptr<Subsurface>(std::move(made));
}

template <template <class> class Diffusion, class Graph>
Result<std::unique_ptr<Subsurface>> of_precision(Graph graph,
                                                 TetMesh mesh,
                                                 const SubsurfaceSetting& setting) {
  const auto make = setting.options.tolerance < kSinglePrecision
                        ? made_of<double, Diffusion<double>, Graph>
                        : made_of<float, Diffusion<float>, Graph>;
  return make(std::move(graph), std::move(mesh), setting);
}

template <class T>
using OnGraph = TwoPoint<T, QuadGraph>;
template <class T>
using OnLattice = TwoPoint<T, Polygrid>;

}  // namespace

Result<std::unique_ptr<Subsurface>> make_graph_subsurface(TetMesh mesh,
                                                          const SubsurfaceSetting& setting) {
  QuadGraph graph = make_quad_graph(mesh);
  if (setting.options.weights == GraphWeights::kAsPublished) {
    return of_precision<PublishedWeights>(std::move(graph), std::move(mesh), setting);
  }
  return of_precision<OnGraph>(std::move(graph), std::move(mesh), setting);
}

Result<std::unique_ptr<Subsurface>> make_polygrid_subsurface(Polygrid grid,
                                                             TetMesh mesh,
                                                             const SubsurfaceSetting& setting) {
  return of_precision<OnLattice>(std::move(grid), std::move(mesh), setting);
}

}  // namespace opaline::render
