#include "render/scene/subsurface.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>

#include "render/graph/polygrid.h"
#include "render/graph/quad_graph.h"
#include "render/scene/subsurface_methods.h"
#include "render/solver/lane_matrix.h"
#include "render/tetrahedra/stuffing.h"

namespace opaline::render {
namespace {

using reconstruct::diffusion::SolveSummary;
using reconstruct::diffusion::Termination;

constexpr int kEnoughDirections = 4;   // of automatic ones, docs/rendering.md
constexpr int kOnceDirections = 8;     // from each tetrahedron, of light scattered once
constexpr double kFarOff = 10.0;       // tolerances; a residual above that is no solution
constexpr double kNormalStep = 0.02;   // of a place's size, for gradients of the distance
constexpr double kBendingStep = 1e-3;  // of a place's size, for those of a deformation

using Power = std::vector<std::array<double, 3>>;

void add(Power& sums, const Power& more) {
  sums.resize(more.size());
  for (std::size_t i = 0; i < more.size(); ++i) {
    for (int c = 0; c < 3; ++c) sums[i][c] += more[i][c];
  }
}

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

Vec3 smooth_normal(const SignedDistance& solid, Vec3 place, Vec3 facet, double size) {
  const Vec3 gradient = solid.normal(place, kNormalStep * size);
  return dot(gradient, facet) > 0.5 ? gradient : facet;
}

double spacing_of(const SignedDistance& solid, const DiffusionOptions& options) {
  if (options.spacing_mm > 0.0) return options.spacing_mm;
  return spacing_for(estimate_volume(solid), options.tetrahedra);
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
  report.mesh_seconds = seconds_since(start);
  return mesh;
}

void take_quality(const TetMesh& mesh, Subsurface::Report& report) {
  const TetQuality quality = quality_of(mesh);
  report.tetrahedra = quality.tets;
  report.volume_mm3 = quality.volume;
  report.smallest_dihedral = quality.smallest_dihedral;
  report.components = quality.components;
  if (!(report.spacing_mm > 0.0)) {
    report.spacing_mm = spacing_for(quality.volume, static_cast<double>(quality.tets));
  }
}

Result<std::unique_ptr<Subsurface>> set_up(TetMesh mesh,
                                           const SubsurfaceSetting& setting,
                                           double spacing_mm,
                                           std::stop_token stop) {
  const Discretisation method = setting.options.method;
  if (method == Discretisation::kElements) {
    return make_elements_subsurface(std::move(mesh), setting);
  }
  if (method == Discretisation::kGraph) return make_graph_subsurface(std::move(mesh), setting);
  auto grid =
      make_polygrid(setting.solid, spacing_mm, setting.options.interior_growth, std::move(stop));
  if (!grid) return grid.error();
  return make_polygrid_subsurface(*std::move(grid), std::move(mesh), setting);
}

double area_of(const TriangleMesh& mesh) {
  double area = 0.0;
  for (const auto& [i, j, k] : mesh.triangles) {
    const Vec3 a = mesh.vertices[i];
    area += 0.5 * length(cross(mesh.vertices[j] - a, mesh.vertices[k] - a));
  }
  return area;
}

/// The vertices of a mesh's surface, numbered as surface_mesh() does.
std::vector<int> surface_vertices(const TetMesh& mesh) {
  std::vector<int> used;
  std::vector<bool> seen(mesh.vertices.size(), false);
  for (const auto& triangle : surface_of(mesh)) {
    for (const int v : triangle) {
      if (!seen[v]) used.push_back(v);
      seen[v] = true;
    }
  }
  return used;
}

}  // namespace

Subsurface::Subsurface(TetMesh mesh, const DiffusionOptions& options)
    : mesh_(std::move(mesh)),
      used_(surface_vertices(mesh_)),
      options_(options),
      surface_(surface_mesh(mesh_)),
      rest_(mesh_.vertices),
      inverted_corners_(used_.size(), false) {}

Result<std::unique_ptr<Subsurface>> Subsurface::create(const SignedDistance& solid,
                                                       const MaterialAt& material,
                                                       double ior,
                                                       const DiffusionOptions& options,
                                                       ThreadTeam& team,
                                                       std::stop_token stop) {
  Report report;
  auto mesh = cut(solid, options, report, stop);
  if (!mesh) return mesh.error();
  DiffusionOptions spaced = options;
  spaced.spacing_mm = report.spacing_mm;
  auto made = create(*std::move(mesh), solid, material, ior, spaced, team, std::move(stop));
  if (made) (*made)->report_.mesh_seconds = report.mesh_seconds;
  return made;
}

Result<std::unique_ptr<Subsurface>> Subsurface::create(TetMesh mesh,
                                                       const SignedDistance& solid,
                                                       const MaterialAt& material,
                                                       double ior,
                                                       const DiffusionOptions& options,
                                                       ThreadTeam& team,
                                                       std::stop_token stop) {
  const auto boundary = reconstruct::diffusion::make_boundary(options.boundary, ior);
  if (!boundary) return boundary.error();
  const auto start = std::chrono::steady_clock::now();
  Report report;
  report.spacing_mm = options.spacing_mm;
  take_quality(mesh, report);
  auto made = set_up(
      std::move(mesh), {solid, material, *boundary, ior, options, team}, report.spacing_mm, stop);
  if (!made) return made.error();
  Report& own = (*made)->report_;
  report.unknowns =
      options.method == Discretisation::kElements ? (*made)->rest_.size() : (*made)->nodes_.size();
  own = report;
  own.area_mm2 = area_of((*made)->surface_);
  (*made)->note_lengths();
  own.setup_seconds = seconds_since(start);
  if (stop.stop_requested()) return cancelled("setting up the diffusion");
  return made;
}

Result<void> Subsurface::begin(const SubsurfaceSetting& setting) {
  const SignedDistance& solid = setting.solid;
  team_ = &setting.team;
  two_a_ = 2.0 * setting.boundary.a;
  nodes_ = nodes();
  sample(setting.material);
  if (auto taken = assemble(); !taken) return taken;
  edges_ = edges_between();
  look_at_shape();
  rest_places_ = flat_places();
  for (SurfacePlace& p : rest_places_) p.normal = smooth_normal(solid, p.place, p.normal, p.size);
  triangle_places_ = flat_triangle_places();
  creases_ = Creases::split(solid, surface_, rest_places_, triangle_places_);
  places_ = rest_places_;
  if (options_.method != Discretisation::kPolygrid) {
    beams_ = std::make_unique<BeamDeposit>(mesh_, optics_, setting.ior);
  }
  return ok();
}

std::vector<TrianglePlaces> Subsurface::flat_triangle_places() const {
  const auto first = static_cast<int>(first_vertex_place());
  std::vector<TrianglePlaces> triangles;
  for (const auto& [a, b, c] : surface_.triangles) {
    triangles.push_back({first + a, first + b, first + c, -1, -1, -1});
  }
  return triangles;
}

Subsurface::Values Subsurface::at_vertices(std::span<const std::array<float, 3>> q) const {
  const auto own = q.subspan(first_vertex_place(), surface_.vertices.size());
  Values values(own.begin(), own.end());
  for (const Creases::Corner& corner : creases_.corners()) {
    auto& mean = values[corner.vertex];
    mean.fill(0.0F);
    for (std::size_t i = 0; i < corner.places.size(); ++i) {
      for (int c = 0; c < 3; ++c) mean[c] += corner.weights[i] * q[corner.places[i]][c];
    }
  }
  return values;
}

void Subsurface::sample(const MaterialAt& material) {
  optics_.resize(nodes_.size());
  team_->run([&](int thread) {
    const RowRange range = share_of(static_cast<int>(nodes_.size()), thread, team_->size());
    for (int i = range.first; i < range.last; ++i) optics_[i] = material(nodes_[i]);
  });
}

void Subsurface::note_lengths() {
  report_.shortest_free_path = std::numeric_limits<double>::infinity();
  report_.shortest_diffusion_length = std::numeric_limits<double>::infinity();
  for (const Optics& o : optics_) {
    for (int c = 0; c < 3; ++c) {
      report_.shortest_free_path = std::min(report_.shortest_free_path, 3.0 * o.diffusion[c]);
      report_.shortest_diffusion_length =
          std::min(report_.shortest_diffusion_length, std::sqrt(o.diffusion[c] / o.absorption[c]));
    }
  }
}

Result<void> Subsurface::set_material(const MaterialAt& material) {
  sample(material);
  if (auto taken = assemble(); !taken) return taken;
  follow_anew();
  note_lengths();
  return ok();
}

Result<std::size_t> Subsurface::bend(const Deformation& deformation) {
  if (options_.method == Discretisation::kPolygrid) {
    return invalid_argument("a lattice cannot bend: method = \"elements\" or \"graph\" can");
  }
  TetMesh bent{rest_, mesh_.tets};
  for (Vec3& p : bent.vertices) p = deformation.at(p);
  std::vector<bool> turned(rest_.size(), false);
  std::size_t inverted = 0;
  for (std::size_t t = 0; t < bent.tets.size(); ++t) {
    if (volume_of(bent, t) > 0.0) continue;
    ++inverted;
    for (const int v : bent.tets[t]) turned[v] = true;
  }
  for (std::size_t v = 0; v < used_.size(); ++v) inverted_corners_[v] = turned[used_[v]];
  if (inverted > 0) return inverted;
  mesh_.vertices = std::move(bent.vertices);
  for (std::size_t v = 0; v < used_.size(); ++v) surface_.vertices[v] = mesh_.vertices[used_[v]];
  if (auto taken = assemble(); !taken) return taken.error();
  follow_anew();
  look_at_shape();
  places_ = flat_places();
  creases_.append(surface_, places_);
  for (std::size_t i = 0; i < places_.size(); ++i) {
    const SurfacePlace& rest = rest_places_[i];
    const Vec3 smooth = deformation.normal(rest.place, rest.normal, kBendingStep * rest.size);
    if (dot(smooth, places_[i].normal) > 0.5) places_[i].normal = smooth;
  }
  return inverted;
}

void Subsurface::follow_anew() {
  if (beams_) beams_->update(mesh_.vertices, optics_);
  environment_.is_stale = lamps_.is_stale = true;
}

/// Follows q to where it scatters first, unless that is known or has to wait. `as_before`: rather as it was than at the surface.
DiffuseEntry Subsurface::enter(Followed& part,
                               std::span<const std::array<float, 3>> q,
                               bool as_before,
                               Pace pace,
                               const std::stop_token& stop) {
  if (std::ranges::all_of(q, [](const auto& v) { return std::ranges::max(v) <= 0.0F; })) {
    return DiffuseEntry::kDark;
  }
  if (!follows()) return DiffuseEntry::kAtSurface;
  const bool is_same = std::ranges::equal(part.q, q);
  if (is_same && !part.is_stale) return DiffuseEntry::kFollowed;
  const bool is_automatic = options_.directions == DiffusionOptions::kAutomatic;
  if (is_automatic && pace == Pace::kMoving) {
    const bool is_near = is_same || (as_before && part.q.size() == q.size());
    return is_near ? DiffuseEntry::kFollowedBefore : DiffuseEntry::kAtSurface;
  }
  const int directions = is_automatic ? kEnoughDirections : options_.directions;
  auto followed = first_scattering(
      *beams_, diffuse_beams(*beams_, on_faces(q), directions), deposit_at(), *team_, stop);
  if (stop.stop_requested()) return DiffuseEntry::kDark;  // and what was followed before stays
  part.light = std::move(followed);
  part.q.assign(q.begin(), q.end());
  part.is_stale = false;
  return DiffuseEntry::kFollowed;
}

Result<SolveSummary> Subsurface::light(const DiffuseLight& diffuse,
                                       std::span<const Beam> beams,
                                       std::stop_token stop) {
  Power scattered;
  passed_once_.clear();
  if (!beams.empty()) {
    if (options_.single_scattering) {
      const auto once =
          first_scattering(*beams_, beams, DepositAt::kTetrahedra, *team_, stop).scattered;
      FirstScattering next =
          next_scattering(*beams_, once, kOnceDirections, deposit_at(), *team_, stop);
      scattered = std::move(next.scattered);
      passed_once_ = std::move(next.passed);
    } else {
      scattered = first_scattering(*beams_, beams, deposit_at(), *team_, stop).scattered;
    }
  }
  environment_.entry = enter(environment_, diffuse.environment, true, diffuse.pace, stop);
  lamps_.entry = enter(lamps_, diffuse.lamps, false, diffuse.pace, stop);
  if (stop.stop_requested()) return cancelled("following the light");
  Values q(places_.size());
  Power passed;
  is_provisional_ = false;
  for (const auto& [part, light] :
       {std::pair{&environment_, diffuse.environment}, {&lamps_, diffuse.lamps}}) {
    if (part->entry == DiffuseEntry::kDark) continue;
    if (part->entry == DiffuseEntry::kAtSurface) {
      for (std::size_t i = 0; i < q.size(); ++i) {
        for (int c = 0; c < 3; ++c) q[i][c] += light[i][c];
      }
      is_provisional_ = is_provisional_ || follows();
      continue;
    }
    is_provisional_ = is_provisional_ || part->entry == DiffuseEntry::kFollowedBefore;
    add(scattered, part->light.scattered);
    add(passed, part->light.passed);
  }
  const SolveSummary summary = solve(q, scattered, stop);
  if (summary.termination == Termination::kCancelled) return cancelled("solving for the light");
  if (!(summary.relative_residual <= kFarOff * options_.tolerance)) {
    return internal_error(
        fmt::format("the light was not found: {}; more max_iterations, a coarser tolerance or "
                    "method = \"elements\" may help",
                    summary.message));
  }
  lit_ = at_surface(q);
  if (!passed.empty()) show_passed(passed);
  return summary;
}

/// Power through faces, as exitance of their corners; with J_n = M, phi = 2 A M it has the angles of diffused light.
void Subsurface::show_passed(const std::vector<std::array<double, 3>>& passed) {
  std::vector<std::array<double, 3>> power(surface_.vertices.size());
  std::vector<double> areas(power.size());
  for (std::size_t f = 0; f < passed.size(); ++f) {
    for (const int v : surface_.triangles[f]) {
      areas[v] += beams_->faces()[f].area;
      for (int c = 0; c < 3; ++c) power[v][c] += passed[f][c];
    }
  }
  for (std::size_t v = 0; v < power.size(); ++v) {
    for (int c = 0; c < 3 && areas[v] > 0.0; ++c) {
      const double exitance = power[v][c] / areas[v];
      lit_.net_flux[v][c] += static_cast<float>(exitance);
      lit_.fluence[v][c] += static_cast<float>(two_a_ * exitance);
    }
  }
}

}  // namespace opaline::render
