#include <algorithm>
#include <cmath>

#include "render/graph/leaning_links.h"
#include "render/graph/published_weights.h"
#include "render/graph/surface_fit.h"
#include "render/graph/two_point.h"
#include "render/scene/fresh_hierarchy.h"
#include "render/scene/subsurface_methods.h"
#include "render/solver/large_pages.h"
#include "render/trace/vertex_values.h"

namespace opaline::render {
namespace {

using reconstruct::diffusion::Boundary;
using reconstruct::diffusion::SolveSummary;

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
    const HierarchyOptions hierarchy{.most_levels = options_.levels};
    solver_ = std::make_unique<FreshHierarchy<T>>(diffusion_.matrix(), hierarchy, setting.team);
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
    add_vertices(places);
    return places;
  }

  void look_at_shape() override {
    if constexpr (kIsLattice) {
      std::vector<SurfaceSample> samples;
      for (const auto& node : graph_.surface) {
        samples.push_back({node.place, node.normal * node.area});
      }
      to_vertices_ = fitted_interpolation(samples, surface());
    } else {
      to_vertices_ = fitted_interpolation(surface());
    }
  }

  std::size_t first_vertex_place() const override { return graph_.surface.size(); }

  DepositAt deposit_at() const override { return DepositAt::kTetrahedra; }

  Values on_faces(std::span<const std::array<float, 3>> q) const override {
    const auto faces = q.first(graph_.surface.size());
    return {faces.begin(), faces.end()};
  }

  SolveSummary solve(std::span<const std::array<float, 3>> q,
                     std::span<const std::array<double, 3>> scattered,
                     std::stop_token stop) override {
    const auto entering = q.first(graph_.surface.size());
    diffusion_.load(entering, load_);
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
    return lean_ ? lean_->settle(
                       entering, load_, phi_, options_.tolerance, options_.corrections, solve)
                 : solve(load_, options_.tolerance);
  }

  SurfaceLight at_surface(std::span<const std::array<float, 3>> q) const override {
    const SurfaceLight light = light_of(q.first(graph_.surface.size()));
    return with_flux(interpolated(to_vertices_, light.fluence), at_vertices(q));
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

  void add_vertices(std::vector<SurfacePlace>& places) const {
    const TriangleMesh& mesh = surface();
    const std::vector<Vec3> normals = vertex_normals(mesh);
    std::vector<double> areas(mesh.vertices.size());
    for (const auto& triangle : mesh.triangles) {
      const Vec3 a = mesh.vertices[triangle[0]];
      const double area =
          0.5 * length(cross(mesh.vertices[triangle[1]] - a, mesh.vertices[triangle[2]] - a));
      for (const int v : triangle) areas[v] += area / 3.0;
    }
    for (std::size_t v = 0; v < areas.size(); ++v)
      places.push_back({mesh.vertices[v], normals[v], std::sqrt(areas[v])});
  }

  /// J_n = (phi - S) / (2 A) of the vertices, from the light there: the fluence hardly bends where the light does, and their
  /// difference may. Fluence is not let below 0, where a fit may be beside a shadow's edge.
  SurfaceLight with_flux(Values fluence, const Values& q) const {
    SurfaceLight light{std::move(fluence), Values(q.size())};
    for (std::size_t v = 0; v < q.size(); ++v) {
      for (int c = 0; c < 3; ++c) {
        float& phi = light.fluence[v][c];
        phi = std::max(phi, 0.0F);
        const double source = boundary_.source_scale * q[v][c];
        light.net_flux[v][c] = static_cast<float>((phi - source) / (2.0 * boundary_.a));
      }
    }
    return light;
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
