#include "render/scene/subsurface.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>

#include "render/graph/finite_elements.h"
#include "render/graph/nearest.h"
#include "render/graph/polygrid.h"
#include "render/graph/two_point.h"
#include "render/solver/lane_solver.h"
#include "render/tetrahedra/stuffing.h"
#include "render/trace/vertex_values.h"

namespace opaline::render {
namespace {

using reconstruct::diffusion::Boundary;
using reconstruct::diffusion::SolveSummary;
using reconstruct::diffusion::Termination;
using Values = std::vector<std::array<float, 3>>;

constexpr int kRemembered = 4;
constexpr int kNearest = 4;
constexpr double kSinglePrecision = 1e-5;  // of the residual; below it numbers are double
constexpr double kFarOff = 10.0;           // tolerances; a residual above that is no solution

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

template <class Places>
std::vector<Optics> optics_at(const Places& places,
                              const Subsurface::MaterialAt& material,
                              ThreadTeam& team) {
  std::vector<Optics> optics(places.size());
  team.run([&](int thread) {
    const RowRange range = share_of(static_cast<int>(places.size()), thread, team.size());
    for (int i = range.first; i < range.last; ++i) optics[i] = material(places[i]);
  });
  return optics;
}

void note_lengths(Subsurface::Report& report, std::span<const Optics> optics) {
  report.shortest_free_path = std::numeric_limits<double>::infinity();
  report.shortest_diffusion_length = std::numeric_limits<double>::infinity();
  for (const Optics& o : optics) {
    for (int c = 0; c < 3; ++c) {
      report.shortest_free_path = std::min(report.shortest_free_path, 3.0 * o.diffusion[c]);
      report.shortest_diffusion_length =
          std::min(report.shortest_diffusion_length, std::sqrt(o.diffusion[c] / o.absorption[c]));
    }
  }
}

/// What all of them share: the tetrahedra and their surface.
struct Ground {
  TetMesh mesh;
  Boundary boundary;
};

Vec3 smooth_normal(const SignedDistance& solid, Vec3 place, Vec3 facet, double size) {
  const Vec3 gradient = solid.normal(place, 0.02 * size);
  return dot(gradient, facet) > 0.5 ? gradient : facet;
}

template <class Graph>
std::vector<SurfacePlace> places_of(const Graph& graph, const SignedDistance& solid) {
  std::vector<SurfacePlace> places;
  places.reserve(graph.surface.size());
  for (const auto& node : graph.surface) {
    const double size = std::sqrt(2.0 * node.area);
    places.push_back({node.place, smooth_normal(solid, node.place, node.normal, size), size});
  }
  return places;
}

template <class T, class Graph>
class GraphSubsurface final : public Subsurface {
 public:
  static Result<std::unique_ptr<Subsurface>> create(Graph graph,
                                                    TetMesh mesh,
                                                    const MaterialAt& material,
                                                    const Boundary& boundary,
                                                    ThreadTeam& team,
                                                    Report report) {
    auto made = std::unique_ptr<GraphSubsurface>(new GraphSubsurface(std::move(graph), boundary));
    const std::vector<Optics> optics = optics_at(made->graph_.inner, material, team);
    if (auto taken = made->diffusion_.set_material(optics); !taken) return taken.error();
    note_lengths(report, optics);
    if constexpr (std::is_same_v<Graph, QuadGraph>) {
      made->beams_ = std::make_unique<BeamDeposit>(std::move(mesh), optics);
    }
    report.unknowns = optics.size();
    made->report_ = report;
    made->solver_ = std::make_unique<LaneSolver<T>>(
        made->diffusion_.matrix(), HierarchyOptions{}, team, kRemembered);
    return made;
  }

  void take_surface(const TriangleMesh& surface,
                    const SignedDistance& solid,
                    const DiffusionOptions& options) {
    options_ = options;
    surface_ = surface;
    places_ = places_of(graph_, solid);
    if constexpr (std::is_same_v<Graph, Polygrid>) {
      std::vector<Vec3> nodes;
      for (const auto& node : graph_.surface) nodes.push_back(node.place);
      to_vertices_ = nearest_interpolation(
          nodes, surface_.vertices, std::min<int>(kNearest, static_cast<int>(nodes.size())));
    }
  }

 protected:
  SolveSummary solve(std::span<const std::array<float, 3>> q,
                     std::span<const Beam> beams,
                     std::stop_token stop) override {
    diffusion_.load(q, load_);
    for (const Beam& beam : beams) {
      beams_->follow(beam, [&](const BeamDeposit::Deposit& d) {
        for (int c = 0; c < 3; ++c) {
          load_[d.tet].set(c, load_[d.tet][c] + static_cast<T>(d.power[c]));
        }
      });
    }
    return solver_->solve(
        load_,
        phi_,
        {.tolerance = options_.tolerance, .max_iterations = options_.max_iterations},
        stop);
  }

  SurfaceLight at_surface(std::span<const std::array<float, 3>> q) const override {
    const SurfaceLight light = diffusion_.surface_light(q, phi_);
    if constexpr (std::is_same_v<Graph, Polygrid>) {
      return {interpolated(light.fluence), interpolated(light.net_flux)};
    } else {
      return at_vertices(surface_, light);
    }
  }

 private:
  GraphSubsurface(Graph graph, const Boundary& boundary)
      : graph_(std::move(graph)),
        diffusion_(graph_, boundary),
        phi_(graph_.inner.size(), Lanes<T>::zero()) {}

  Values interpolated(const Values& nodes) const {
    Values values(surface_.vertices.size());
    for (int v = 0; v < to_vertices_.rows(); ++v) {
      for (int e = to_vertices_.starts[v]; e < to_vertices_.starts[v + 1]; ++e) {
        for (int c = 0; c < 3; ++c) {
          values[v][c] += to_vertices_.weights[e] * nodes[to_vertices_.columns[e]][c];
        }
      }
    }
    return values;
  }

  Graph graph_;
  TwoPoint<T, Graph> diffusion_;
  std::unique_ptr<LaneSolver<T>> solver_;
  std::vector<Lanes<T>> load_;
  std::vector<Lanes<T>> phi_;
  Interpolation<float> to_vertices_;
};

class ElementsSubsurface final : public Subsurface {
 public:
  static Result<std::unique_ptr<Subsurface>> create(TetMesh mesh,
                                                    const MaterialAt& material,
                                                    const Boundary& boundary,
                                                    const SignedDistance& solid,
                                                    const DiffusionOptions& options,
                                                    ThreadTeam& team,
                                                    Report report) {
    auto made =
        std::unique_ptr<ElementsSubsurface>(new ElementsSubsurface(std::move(mesh), options));
    std::vector<Vec3> centroids;
    for (std::size_t t = 0; t < made->mesh_.tets.size(); ++t) {
      centroids.push_back(centroid_of(made->mesh_, t));
    }
    const std::vector<Optics> optics = optics_at(centroids, material, team);
    auto elements = FiniteElements::create(made->mesh_, optics, boundary);
    if (!elements) return elements.error();
    made->elements_ = std::make_unique<FiniteElements>(*std::move(elements));
    made->beams_ = std::make_unique<BeamDeposit>(made->mesh_, optics);
    note_lengths(report, optics);
    report.unknowns = made->mesh_.vertices.size();
    made->report_ = report;
    made->solver_ = std::make_unique<LaneSolver<double>>(
        made->elements_->matrix(), HierarchyOptions{.first_rings = 1}, team, kRemembered);
    made->take_surface(solid);
    return made;
  }

 protected:
  SolveSummary solve(std::span<const std::array<float, 3>> q,
                     std::span<const Beam> beams,
                     std::stop_token stop) override {
    std::vector<Lanes<double>> load = elements_->load(on_mesh(q));
    for (const Beam& beam : beams) {
      beams_->follow(beam, [&](const BeamDeposit::Deposit& d) {
        for (int k = 0; k < 4; ++k) {
          Lanes<double>& sum = load[mesh_.tets[d.tet][k]];
          for (int c = 0; c < 3; ++c) sum.set(c, sum[c] + d.corners[c][k] * d.power[c]);
        }
      });
    }
    return solver_->solve(
        load,
        phi_,
        {.tolerance = options_.tolerance, .max_iterations = options_.max_iterations},
        stop);
  }

  SurfaceLight at_surface(std::span<const std::array<float, 3>> q) const override {
    const SurfaceLight all = elements_->surface_light(on_mesh(q), phi_);
    SurfaceLight light{Values(used_.size()), Values(used_.size())};
    for (std::size_t v = 0; v < used_.size(); ++v) {
      light.fluence[v] = all.fluence[used_[v]];
      light.net_flux[v] = all.net_flux[used_[v]];
    }
    return light;
  }

 private:
  ElementsSubsurface(TetMesh mesh, const DiffusionOptions& options)
      : mesh_(std::move(mesh)), phi_(mesh_.vertices.size(), Lanes<double>::zero()) {
    options_ = options;
  }

  void take_surface(const SignedDistance& solid) {
    surface_ = surface_mesh(mesh_);
    std::vector<bool> seen(mesh_.vertices.size(), false);
    for (const auto& triangle : surface_of(mesh_)) {  // numbered as surface_mesh() does
      for (const int v : triangle) {
        if (!seen[v]) used_.push_back(v);
        seen[v] = true;
      }
    }
    const std::vector<Vec3> normals = vertex_normals(surface_);
    for (std::size_t v = 0; v < used_.size(); ++v) {
      const double size = std::sqrt(elements_->surface_areas()[used_[v]]);
      const Vec3 place = surface_.vertices[v];
      places_.push_back({place, smooth_normal(solid, place, normals[v], size), size});
    }
  }

  Values on_mesh(std::span<const std::array<float, 3>> q) const {
    Values all(mesh_.vertices.size());
    for (std::size_t v = 0; v < used_.size(); ++v) all[used_[v]] = q[v];
    return all;
  }

  TetMesh mesh_;
  std::unique_ptr<FiniteElements> elements_;
  std::vector<int> used_;  // the mesh's vertex of each of the surface's
  std::unique_ptr<LaneSolver<double>> solver_;
  std::vector<Lanes<double>> phi_;
};

double spacing_of(const SignedDistance& solid, const DiffusionOptions& options) {
  if (options.spacing_mm > 0.0) return options.spacing_mm;
  return spacing_for(estimate_volume(solid), options.tetrahedra);
}

template <class T, class Graph>
Result<std::unique_ptr<Subsurface>> graph_subsurface(Graph graph,
                                                     TetMesh mesh,
                                                     const SignedDistance& solid,
                                                     const Subsurface::MaterialAt& material,
                                                     const Boundary& boundary,
                                                     const DiffusionOptions& options,
                                                     ThreadTeam& team,
                                                     const Subsurface::Report& report) {
  const TriangleMesh surface = surface_mesh(mesh);
  auto made = GraphSubsurface<T, Graph>::create(
      std::move(graph), std::move(mesh), material, boundary, team, report);
  if (made) {
    static_cast<GraphSubsurface<T, Graph>&>(**made).take_surface(surface, solid, options);
  }
  return made;
}

template <class Graph>
Result<std::unique_ptr<Subsurface>> graph_of_precision(Graph graph,
                                                       TetMesh mesh,
                                                       const SignedDistance& solid,
                                                       const Subsurface::MaterialAt& material,
                                                       const Boundary& boundary,
                                                       const DiffusionOptions& options,
                                                       ThreadTeam& team,
                                                       const Subsurface::Report& report) {
  const auto make = options.tolerance < kSinglePrecision ? graph_subsurface<double, Graph>
                                                         : graph_subsurface<float, Graph>;
  return make(std::move(graph), std::move(mesh), solid, material, boundary, options, team, report);
}

Result<TetMesh> cut(const SignedDistance& solid,
                    const DiffusionOptions& options,
                    Subsurface::Report& report,
                    std::stop_token stop) {
  const auto start = std::chrono::steady_clock::now();
  report.spacing_mm = spacing_of(solid, options);
  if (!(report.spacing_mm > 0.0)) {
    return invalid_argument("the shape encloses nothing: a closed surface has an inside");
  }
  const auto stuffed = stuff(
      solid, {.spacing_mm = report.spacing_mm, .interior_growth = options.interior_growth}, stop);
  if (!stuffed) return stuffed.error();
  TetMesh mesh = pack(*stuffed);
  const TetQuality quality = quality_of(mesh);
  report.tetrahedra = quality.tets;
  report.volume_mm3 = quality.volume;
  report.smallest_dihedral = quality.smallest_dihedral;
  report.components = quality.components;
  report.mesh_seconds = seconds_since(start);
  return mesh;
}

Result<std::unique_ptr<Subsurface>> set_up(TetMesh mesh,
                                           const SignedDistance& solid,
                                           const Subsurface::MaterialAt& material,
                                           const Boundary& boundary,
                                           const DiffusionOptions& options,
                                           ThreadTeam& team,
                                           const Subsurface::Report& report,
                                           std::stop_token stop) {
  if (options.method == Discretisation::kElements) {
    return ElementsSubsurface::create(
        std::move(mesh), material, boundary, solid, options, team, report);
  }
  if (options.method == Discretisation::kGraph) {
    QuadGraph graph = make_quad_graph(mesh);
    return graph_of_precision(
        std::move(graph), std::move(mesh), solid, material, boundary, options, team, report);
  }
  auto grid = make_polygrid(solid, report.spacing_mm, stop);
  if (!grid) return grid.error();
  return graph_of_precision(
      *std::move(grid), std::move(mesh), solid, material, boundary, options, team, report);
}

}  // namespace

Result<std::unique_ptr<Subsurface>> Subsurface::create(const SignedDistance& solid,
                                                       const MaterialAt& material,
                                                       double ior,
                                                       const DiffusionOptions& options,
                                                       ThreadTeam& team,
                                                       std::stop_token stop) {
  const auto boundary = reconstruct::diffusion::make_boundary(options.boundary, ior);
  if (!boundary) return boundary.error();
  Report report;
  auto mesh = cut(solid, options, report, stop);
  if (!mesh) return mesh.error();
  const auto start = std::chrono::steady_clock::now();
  auto made = set_up(*std::move(mesh), solid, material, *boundary, options, team, report, stop);
  if (!made) return made.error();
  (*made)->report_.setup_seconds = seconds_since(start);
  if (stop.stop_requested()) return cancelled("setting up the diffusion");
  return made;
}

Result<SolveSummary> Subsurface::light(std::span<const std::array<float, 3>> q,
                                       std::span<const Beam> beams,
                                       std::stop_token stop) {
  const SolveSummary summary = solve(q, beams, stop);
  if (summary.termination == Termination::kCancelled) return cancelled("solving for the light");
  if (!(summary.relative_residual <= kFarOff * options_.tolerance)) {
    return internal_error(
        fmt::format("the light was not found: {}; more max_iterations, a coarser tolerance or "
                    "method = \"elements\" may help",
                    summary.message));
  }
  lit_ = at_surface(q);
  return summary;
}

}  // namespace opaline::render
