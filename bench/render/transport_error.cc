#include "bench/render/transport_error.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <memory>
#include <numbers>
#include <vector>

#include "base/ensure.h"
#include "base/log.h"
#include "bench/render/render_case.h"
#include "render/mesh/shapes.h"
#include "render/scene/single_scattering.h"
#include "render/scene/subsurface.h"
#include "render/tetrahedra/stuffing.h"
#include "sim/fresnel.h"
#include "sim/tet_transport.h"

namespace opaline::bench {
namespace {

constexpr Vec3 kTowards{0.6, 0.48, 0.64};
const Vec3 kAside = normalized(Vec3{0.64, 0.0, -0.6});  // across that
constexpr double kPatch = 2.5;                          // mm
constexpr int kGreen = 1;

/// Numbers patches by the cell of a grid that a place lies in.
class Patches {
 public:
  int at(Vec3 p) {
    const auto cell = [](double x) { return static_cast<int>(std::floor(x / kPatch)); };
    return numbers_
        .try_emplace({cell(p.x), cell(p.y), cell(p.z)}, static_cast<int>(numbers_.size()))
        .first->second;
  }
  int count() const { return static_cast<int>(numbers_.size()); }

 private:
  std::map<std::array<int, 3>, int> numbers_;
};

struct Case {
  const render::SignedDistance& solid;
  bool collimated = false;
  double ior = 1.0;
  /// q at a place of the surface with a normal: what is transmitted into it.
  double q(Vec3 normal) const {
    const double cosine = dot(normal, kTowards);
    return cosine > 0.0 ? cosine * (1.0 - sim::reflectance(std::min(1.0, cosine), 1.0, ior)) : 0.0;
  }
};

/// How thick a solid is below a place of its surface, in transport mean free paths of the green along the normal.
double thickness_below(const render::SignedDistance& solid, Vec3 place, Vec3 normal) {
  constexpr double kStep = 0.1;  // mm
  double paths = 0.0;
  for (int k = 1;; ++k) {
    const Vec3 p = place - normal * (k * kStep);
    if (k > 1 && !(solid.at(p) < 0.0)) return paths;
    paths += kStep / (3.0 * marbled_optics(p).diffusion[kGreen]);
  }
}

struct Exitance {
  std::vector<double> power;  // that leaves each patch
  std::vector<double> area;
  void add(int patch, double watts, double square_mm) {
    const auto size = std::max<std::size_t>(power.size(), static_cast<std::size_t>(patch) + 1);
    power.resize(size);
    area.resize(size);
    power[patch] += watts;
    area[patch] += square_mm;
  }
};

Vec3 area_vector(Vec3 a, Vec3 b, Vec3 c) { return cross(b - a, c - a) * 0.5; }

/// A beam into each face that the light falls on, refracted (Snell).
std::vector<render::Beam> beams_into(const Case& lit, const render::BeamDeposit& deposit) {
  std::vector<render::Beam> beams;
  for (std::size_t f = 0; f < deposit.faces().size(); ++f) {
    const auto& face = deposit.faces()[f];
    const Vec3 normal = face.middle.normal;
    const double watts = face.area * lit.q(normal);
    if (!(watts > 0.0)) continue;
    const Vec3 tangent = (normal * dot(normal, kTowards) - kTowards) * (1.0 / lit.ior);
    const Vec3 along = tangent - normal * std::sqrt(1.0 - dot(tangent, tangent));
    beams.push_back({static_cast<int>(f), along, {watts, watts, watts}});
  }
  return beams;
}

std::unique_ptr<render::Subsurface> lit_body(const Case& lit,
                                             const render::DiffusionOptions& options,
                                             ThreadTeam& team) {
  auto body = render::Subsurface::create(lit.solid, marbled_optics, lit.ior, options, team, {});
  ENSURE(body.has_value());
  std::vector<std::array<float, 3>> q((*body)->places().size());
  std::vector<render::Beam> beams;
  if (lit.collimated) {
    beams = beams_into(lit, *(*body)->beams());
  } else {
    for (std::size_t i = 0; i < q.size(); ++i) {
      q[i].fill(static_cast<float>(lit.q((*body)->places()[i].normal)));
    }
  }
  ENSURE((*body)->light(q, beams, {}).has_value());
  return *std::move(body);
}

Exitance diffused(const Case& lit,
                  const render::DiffusionOptions& options,
                  Patches& patches,
                  ThreadTeam& team) {
  const auto body = lit_body(lit, options, team);
  const auto& mesh = body->surface();
  Exitance found;
  for (std::size_t f = 0; f < mesh.triangles.size(); ++f) {
    const auto& [i, j, k] = mesh.triangles[f];
    const Vec3 a = mesh.vertices[i];
    const Vec3 b = mesh.vertices[j];
    const Vec3 c = mesh.vertices[k];
    const Vec3 normal = area_vector(a, b, c);
    const Vec3 centre = (a + b + c) * (1.0 / 3.0);
    double net = 0.0;
    for (const int v : {i, j, k}) net += body->lit().net_flux[v][kGreen] / 3.0;
    const double in =
        lit.collimated || options.directions != 0 ? 0.0 : lit.q(lit.solid.normal(centre, 0.01));
    const double once = body->passed_once().empty() ? 0.0 : body->passed_once()[f][kGreen];
    found.add(patches.at(centre), (net + in) * length(normal) + once, length(normal));
  }
  return found;
}

/// The light that leaves within an angle about a direction.
struct Seen {
  static constexpr double kCosine = 0.95;
  Vec3 towards;
  std::vector<Vec3> directions() const {
    constexpr int kCount = 8;
    const render::Frame frame = render::frame_around(towards);
    std::vector<Vec3> found;
    for (int k = 0; k < kCount; ++k) {
      const double cosine = 1.0 - (1.0 - kCosine) * (k + 0.5) / kCount;
      const double sine = std::sqrt(1.0 - cosine * cosine);
      found.push_back(frame.to_scene({sine * std::cos(2.4 * k), sine * std::sin(2.4 * k), cosine}));
    }
    return found;
  }
  double solid_angle() const { return 2.0 * std::numbers::pi * (1.0 - kCosine); }
};

Exitance rendered(const Case& lit,
                  const Seen& seen,
                  const render::DiffusionOptions& options,
                  Patches& patches,
                  ThreadTeam& team) {
  const auto body = lit_body(lit, options, team);
  const render::TriangleMesh& mesh = body->surface();
  const render::DrawnSurface drawn(mesh, lit.solid, 0);
  render::Surfaces surfaces;
  surfaces.add(mesh, drawn.normals());
  ENSURE(surfaces.build().has_value());
  const std::vector<render::LightOptions> lamps{
      {.direction = kTowards * -1.0, .irradiance = {1.0, 1.0, 1.0}, .shadows = false}};
  const render::SingleScattering once(*body->beams(), mesh, drawn, surfaces, lamps, lit.ior);
  const std::vector<Vec3> directions = seen.directions();
  Exitance found;
  for (std::size_t f = 0; f < mesh.triangles.size(); ++f) {
    const auto& face = body->beams()->faces()[f];
    double radiance = 0.0;  // times the cosine
    for (const Vec3& view : directions) {
      const double cosine = dot(face.middle.normal, view);
      if (!(cosine > 0.0)) continue;
      const double inside = std::sqrt(1.0 - (1.0 - cosine * cosine) / (lit.ior * lit.ior));
      double phi = 0.0;
      for (const int v : mesh.triangles[f]) {
        phi +=
            (body->lit().fluence[v][kGreen] + 3.0 * inside * body->lit().net_flux[v][kGreen]) / 3;
      }
      if (options.single_scattering) {
        phi += once.seen(
            f, face.middle.place, render::refracted(view, face.middle.normal, lit.ior))[kGreen];
      }
      radiance += cosine * phi * (1.0 - sim::reflectance(std::min(1.0, cosine), 1.0, lit.ior)) /
                  (4.0 * std::numbers::pi * lit.ior * lit.ior);
    }
    found.add(patches.at(face.middle.place),
              radiance / static_cast<double>(directions.size()) * seen.solid_angle() * face.area,
              face.area);
  }
  return found;
}

struct Traced {
  Exitance exitance;
  std::vector<double> error;  // of each patch's power
  std::vector<double>
      thickness;  // of the solid below each patch, mean free paths, times the patch's area
};

Traced traced(const Case& lit, const Seen* seen, double spacing, double photons, Patches& patches) {
  const auto stuffed =
      render::stuff(lit.solid, {.spacing_mm = spacing, .interior_growth = 0.1}, {});
  ENSURE(stuffed.has_value());
  const render::TetMesh mesh = render::pack(*stuffed);
  sim::TetSolid solid{mesh.vertices, mesh.tets, {}, {}, lit.ior};
  for (std::size_t t = 0; t < mesh.tets.size(); ++t) {
    const render::Optics optics = marbled_optics(render::centroid_of(mesh, t));
    solid.absorption.push_back(optics.absorption[kGreen]);
    solid.scattering.push_back(1.0 / (3.0 * optics.diffusion[kGreen]) - optics.absorption[kGreen]);
  }
  Traced found;
  std::vector<double> power;
  std::vector<int> patch;
  for (const auto& [tet, opposite] : sim::surface_faces(solid)) {
    std::array<Vec3, 3> p;
    for (int k = 0; k < 3; ++k) p[k] = mesh.vertices[mesh.tets[tet][(opposite + 1 + k) % 4]];
    Vec3 facet = area_vector(p[0], p[1], p[2]);
    const double area = length(facet);
    const Vec3 centre = (p[0] + p[1] + p[2]) * (1.0 / 3.0);
    const Vec3 smooth = lit.solid.normal(centre, 0.01);
    if (dot(facet, smooth) < 0.0) facet = facet * -1.0;
    power.push_back(area * lit.q(lit.collimated ? normalized(facet) : smooth));
    patch.push_back(patches.at(centre));
    found.exitance.add(patch.back(), 0.0, area);
    found.thickness.resize(found.exitance.area.size());
    found.thickness[patch.back()] += area * thickness_below(lit.solid, centre, smooth);
  }
  const auto result = sim::trace_tets(
      solid,
      power,
      patch,
      {.entry = lit.collimated ? sim::TetEntry::kCollimated : sim::TetEntry::kDiffuse,
       .direction = kTowards * -1.0,
       .count_unscattered = !lit.collimated,
       .seen = seen != nullptr ? seen->towards : Vec3{0.0, 0.0, 1.0},
       .seen_cosine = seen != nullptr ? Seen::kCosine : -1.0,
       .photons = static_cast<std::uint64_t>(photons),
       .threads = 2},
      {});
  if (!result) log::error("{}", result.error().message);
  ENSURE(result.has_value());
  double entered = 0.0;
  for (const double watts : power) entered += watts;
  for (std::size_t k = 0; k < result->left.size(); ++k) {
    found.exitance.power[k] = result->left[k] * entered;
    found.error.push_back(result->standard_error[k] * entered);
  }
  return found;
}

/// Which patches count.
using Chosen = std::function<bool(std::size_t patch)>;

struct Difference {
  double rms = 0.0;   // relative, of exitance, W/mm^2, over the area
  double bias = 0.0;  // of the power that leaves
  double area = 0.0;
};

/// `noise` of the second is taken out of the RMS.
Difference difference(const Exitance& a, const Exitance& b, double noise, const Chosen& chosen) {
  double error = 0.0;
  double size = 0.0;
  double more = 0.0;
  double power = 0.0;
  Difference found;
  for (std::size_t k = 0; k < std::min(a.power.size(), b.power.size()); ++k) {
    if (!(a.area[k] > 0.0) || !(b.area[k] > 0.0) || !chosen(k)) continue;
    const double truth = b.power[k] / b.area[k];
    const double off = a.power[k] / a.area[k] - truth;
    error += b.area[k] * off * off;
    size += b.area[k] * truth * truth;
    more += b.area[k] * off;
    power += b.power[k];
    found.area += b.area[k];
  }
  if (!(found.area > 0.0)) return found;
  found.rms = std::sqrt(std::max(0.0, error / size - noise * noise));
  found.bias = more / power;
  return found;
}

double noise_of(const Traced& traced, const Chosen& chosen) {
  double error = 0.0;
  double size = 0.0;
  for (std::size_t k = 0; k < traced.error.size(); ++k) {
    const double area = traced.exitance.area[k];
    if (!(area > 0.0) || !chosen(k)) continue;
    error += traced.error[k] * traced.error[k] / area;
    size += traced.exitance.power[k] * traced.exitance.power[k] / area;
  }
  return size > 0.0 ? std::sqrt(error / size) : 0.0;
}

}  // namespace

TransportError transport_error(std::string_view name,
                               bool collimated,
                               const render::DiffusionOptions& options,
                               double photons,
                               ThreadTeam& team) {
  const auto solid = shape(name);
  const Case lit{*solid, collimated, collimated ? 1.3 : 1.0};
  Patches patches;
  render::DiffusionOptions finer = options;
  finer.method = render::Discretisation::kElements;
  finer.spacing_mm = 0.5 * options.spacing_mm;
  const Exitance asked = diffused(lit, options, patches, team);
  const Exitance fine = diffused(lit, finer, patches, team);
  const Traced light = traced(lit, nullptr, options.spacing_mm, photons, patches);
  TransportError error;
  const Chosen all = [](std::size_t) { return true; };
  error.noise = noise_of(light, all);
  error.total = difference(asked, light.exitance, error.noise, all).rms;
  error.model = difference(fine, light.exitance, error.noise, all).rms;
  error.discretisation = difference(asked, fine, 0.0, all).rms;
  double least = 0.0;
  for (TransportError::Band& band : error.bands) {
    const Chosen within = [&](std::size_t k) {
      const double thickness = light.thickness[k] / light.exitance.area[k];
      return thickness >= least && thickness < band.below;
    };
    const Difference found = difference(fine, light.exitance, noise_of(light, within), within);
    band.model = found.rms;
    band.bias = found.bias;
    band.area_mm2 = found.area;
    least = band.below;
  }
  error.patches = patches.count();
  return error;
}

RadianceError radiance_error(std::string_view name,
                             double degrees,
                             const render::DiffusionOptions& options,
                             double photons,
                             ThreadTeam& team) {
  const auto solid = shape(name);
  const Case lit{*solid, true, 1.3};
  const double angle = degrees * std::numbers::pi / 180.0;
  const Seen seen{kTowards * std::cos(angle) + kAside * std::sin(angle)};
  Patches patches;
  render::DiffusionOptions sharp = options;
  sharp.single_scattering = true;
  const Exitance without = rendered(lit, seen, options, patches, team);
  const Exitance with = rendered(lit, seen, sharp, patches, team);
  const Traced light = traced(lit, &seen, options.spacing_mm, photons, patches);
  const Chosen all = [](std::size_t) { return true; };
  RadianceError error;
  error.noise = noise_of(light, all);
  error.diffused = difference(without, light.exitance, error.noise, all).rms;
  error.sharp = difference(with, light.exitance, error.noise, all).rms;
  return error;
}

}  // namespace opaline::bench
