#include <cmath>

#include "render/graph/finite_elements.h"
#include "render/scene/fresh_hierarchy.h"
#include "render/scene/subsurface_methods.h"
#include "render/solver/large_pages.h"
#include "render/trace/vertex_values.h"

namespace opaline::render {
namespace {

using reconstruct::diffusion::Boundary;
using reconstruct::diffusion::SolveSummary;

class ElementsSubsurface final : public Subsurface {
 public:
  ElementsSubsurface(TetMesh mesh, const SubsurfaceSetting& setting)
      : Subsurface(std::move(mesh), setting.options),
        boundary_(setting.boundary),
        phi_(large_vector(mesh_.vertices.size(), Lanes<double>::zero())) {}

  Result<void> begin_with(const SubsurfaceSetting& setting) {
    if (auto begun = begin(setting); !begun) return begun;
    const HierarchyOptions hierarchy{.first_rings = 1, .most_levels = options_.levels};
    solver_ =
        std::make_unique<FreshHierarchy<double>>(elements_->matrix(), hierarchy, setting.team);
    return ok();
  }

 protected:
  Result<void> assemble() override {
    if (!elements_) {
      auto made = FiniteElements::create(mesh_, optics_, boundary_);
      if (!made) return made.error();
      elements_ = std::make_unique<FiniteElements>(*std::move(made));
      return ok();
    }
    auto taken = elements_->update(optics_);
    if (taken && solver_) solver_->matrix_changed();
    return taken;
  }

  std::vector<std::array<int, 2>> edges_between() const override {
    std::vector<int> number(mesh_.vertices.size(), -1);
    for (std::size_t v = 0; v < used_.size(); ++v) number[used_[v]] = static_cast<int>(v);
    std::vector<std::array<int, 2>> edges;
    for (const auto& [a, b] : elements_->surface_edges()) edges.push_back({number[a], number[b]});
    return edges;
  }

  std::vector<Vec3> nodes() const override {
    std::vector<Vec3> centroids;
    centroids.reserve(mesh_.tets.size());
    for (std::size_t t = 0; t < mesh_.tets.size(); ++t) centroids.push_back(centroid_of(mesh_, t));
    return centroids;
  }

  std::vector<SurfacePlace> flat_places() const override {
    std::vector<SurfacePlace> places;
    const std::vector<Vec3> normals = vertex_normals(surface());
    for (std::size_t v = 0; v < used_.size(); ++v) {
      places.push_back(
          {surface().vertices[v], normals[v], std::sqrt(elements_->surface_areas()[used_[v]])});
    }
    for (const auto& [a, b] : edges()) {
      places.push_back({(surface().vertices[a] + surface().vertices[b]) * 0.5,
                        normalized(normals[a] + normals[b]),
                        0.5 * (places[a].size + places[b].size)});
    }
    return places;
  }

  std::size_t first_vertex_place() const override { return 0; }

  std::vector<TrianglePlaces> flat_triangle_places() const override {
    std::vector<TrianglePlaces> places = Subsurface::flat_triangle_places();
    for (std::size_t t = 0; t < places.size(); ++t) {
      for (int k = 0; k < 3; ++k) {
        places[t][3 + k] = static_cast<int>(used_.size()) + elements_->edges_of_triangles()[t][k];
      }
    }
    return places;
  }

  DepositAt deposit_at() const override { return DepositAt::kVertices; }

  /// The mean over the three middles is the integral over the triangle of whatever is quadratic there.
  Values on_faces(std::span<const std::array<float, 3>> q) const override {
    Values faces;
    for (const TrianglePlaces& at : triangle_places()) {
      auto& mean = faces.emplace_back();
      for (int c = 0; c < 3; ++c) mean[c] = (q[at[3]][c] + q[at[4]][c] + q[at[5]][c]) / 3.0F;
    }
    return faces;
  }

  SolveSummary solve(std::span<const std::array<float, 3>> q,
                     std::span<const std::array<double, 3>> scattered,
                     std::stop_token stop) override {
    std::vector<Lanes<double>> load = elements_->load(q, triangle_places());
    for (std::size_t v = 0; v < scattered.size(); ++v) {
      for (int c = 0; c < 3; ++c) load[v].set(c, load[v][c] + scattered[v][c]);
    }
    return solver_->solve(load, phi_, solve_options(), stop);
  }

  SurfaceLight at_surface(std::span<const std::array<float, 3>> q) const override {
    const SurfaceLight all = elements_->surface_light(on_mesh(at_vertices(q)), phi_);
    SurfaceLight light{Values(used_.size()), Values(used_.size())};
    for (std::size_t v = 0; v < used_.size(); ++v) {
      light.fluence[v] = all.fluence[used_[v]];
      light.net_flux[v] = all.net_flux[used_[v]];
    }
    return light;
  }

 private:
  Values on_mesh(const Values& q) const {
    Values all(mesh_.vertices.size());
    for (std::size_t v = 0; v < used_.size(); ++v) all[used_[v]] = q[v];
    return all;
  }

  Boundary boundary_;
  std::unique_ptr<FiniteElements> elements_;
  std::unique_ptr<FreshHierarchy<double>> solver_;
  std::vector<Lanes<double>> phi_;
};

}  // namespace

Result<std::unique_ptr<Subsurface>> make_elements_subsurface(TetMesh mesh,
                                                             const SubsurfaceSetting& setting) {
  auto made = std::make_unique<ElementsSubsurface>(std::move(mesh), setting);
  if (auto begun = made->begin_with(setting); !begun) return begun.error();
  return std::unique_ptr<Subsurface>(std::move(made));
}

}  // namespace opaline::render
