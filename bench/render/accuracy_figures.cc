#include "bench/render/accuracy_figures.h"

#include <fmt/format.h>

#include <cmath>
#include <string>
#include <vector>

#include "bench/figure.h"
#include "bench/render/radiance_error.h"
#include "bench/render/render_case.h"
#include "bench/render/sphere_error.h"
#include "bench/render/transport_error.h"
#include "render/tetrahedra/stuffing.h"

namespace opaline::bench {
namespace {

using reconstruct::diffusion::BoundaryModel;

constexpr int kThreads = 2;

/// The model's error by how thick the solid is.
void print_bands(const std::string& which, const TransportError& error) {
  for (const TransportError::Band& band : error.bands) {
    if (!(band.area_mm2 > 0.0)) continue;
    const std::string name = fmt::format("{}-below-{}-paths", which, band.below);
    print_figure("render.model_error", name, band.model, "1");
    print_figure("render.model_bias", name, band.bias, "1");
    print_figure("render.model_area", name, band.area_mm2, "mm^2");
  }
}

}  // namespace

void measure_sphere() {
  ThreadTeam team(kThreads);
  const auto sphere = shape("sphere");
  for (const auto& [name, tets] : {std::pair{"13k", 13e3}, std::pair{"52k", 52e3}}) {
    const render::TetMesh mesh = cut(*sphere, tets);
    print_figure("render.sphere_tets", name, static_cast<double>(mesh.tets.size()), "1");
    print_figure("render.sphere_rms_graph", name, graph_error(mesh, 20, team), "1");
    print_figure("render.sphere_rms_two_point", name, graph_error(mesh, 0, team), "1");
    print_figure("render.sphere_rms_fem", name, elements_error(mesh, team), "1");
  }
  for (const auto& [name, spacing] : {std::pair{"h1.25", 1.25}, std::pair{"h0.8", 0.8}}) {
    print_figure("render.sphere_rms_polygrid", name, polygrid_error(*sphere, spacing, team), "1");
  }
}

void measure_accuracy() {
  ThreadTeam team(kThreads);
  for (const char* name : {"torus", "figurine"}) {
    const auto solid = shape(name);
    const double spacing = render::spacing_for(render::estimate_volume(*solid), 1.4e5);
    const auto lit = [&](render::Discretisation method, double size, double growth) {
      return LitMarble(*solid,
                       {.method = method,
                        .directions = 0,
                        .spacing_mm = size,
                        .interior_growth = growth,
                        .tolerance = 1e-8},
                       team);
    };
    using enum render::Discretisation;
    const LitMarble reference = lit(kElements, 0.25 * spacing, 0.2);
    print_figure("render.reference_error_estimate",
                 name,
                 lit(kElements, 0.5 * spacing, 0.2).error_against(reference) / 3.0,
                 "1");
    for (const int times : {2, 4}) {
      const LitMarble marble = lit(kElements, spacing / std::cbrt(times), 0.1);
      const std::string which = fmt::format("{}-K0.1-fem-{}-times", name, times);
      print_figure("render.error_vs_fem", which, marble.error_against(reference), "1");
      print_figure(
          "render.error_vs_fem_tets", which, static_cast<double>(marble.tetrahedra()), "1");
      print_figure(
          "render.error_vs_fem_unknowns", which, static_cast<double>(marble.unknowns()), "1");
    }
    for (const auto& [growth, k] : {std::pair{1.0, "K1"}, std::pair{0.1, "K0.1"}}) {
      for (const auto& [method, what] : {std::pair{kGraph, "graph"}, std::pair{kElements, "fem"}}) {
        const LitMarble marble = lit(method, spacing, growth);
        const std::string which = std::string(name) + "-" + k + "-" + what;
        print_figure("render.error_vs_fem", which, marble.error_against(reference), "1");
        print_figure(
            "render.error_vs_fem_tets", which, static_cast<double>(marble.tetrahedra()), "1");
        print_figure(
            "render.error_vs_fem_unknowns", which, static_cast<double>(marble.unknowns()), "1");
      }
    }
  }
}

/// Where the error of elements of K = 0.1 comes from: the same facets with eight times as many elements, and what those are off.
void measure_geometry() {
  ThreadTeam team(kThreads);
  for (const char* name : {"torus", "figurine"}) {
    const auto solid = shape(name);
    const double spacing = render::spacing_for(render::estimate_volume(*solid), 1.4e5);
    const render::DiffusionOptions options{
        .directions = 0, .spacing_mm = spacing, .tolerance = 1e-8};
    render::DiffusionOptions finer = options;
    finer.spacing_mm = 0.5 * spacing;
    finer.interior_growth = 0.0;
    const LitMarble reference(*solid, finer, team);
    const render::TetMesh mesh = cut(*solid, 1.4e5, 0.1);
    const LitMarble coarse(mesh, *solid, options, team);
    const LitMarble same_facets(cut_into_eight(mesh), *solid, options, team);
    const std::string which(name);
    print_figure("render.error_vs_fem", which, coarse.error_against(reference), "1");
    print_figure("render.error_of_elements", which, coarse.error_against(same_facets), "1");
    print_figure("render.error_of_facets", which, same_facets.error_against(reference), "1");
  }
}

namespace {

constexpr std::array kDirections{std::pair{render::DiffusionOptions::kAutomatic, ""},
                                 std::pair{0, "-0-directions"}};

/// Elements of the size of 140 k tetrahedra all alike, K = 0.1.
render::DiffusionOptions elements_of(const std::string& name, int directions) {
  return {.method = render::Discretisation::kElements,
          .directions = directions,
          .spacing_mm = render::spacing_for(render::estimate_volume(*shape(name)), 1.4e5),
          .interior_growth = 0.1,
          .tolerance = 1e-8};
}

void print_transport_error(const std::string& which, const TransportError& error) {
  print_figure("render.error_vs_monte_carlo", which, error.total, "1");
  print_figure("render.model_error", which, error.model, "1");
  print_figure("render.discretisation_error", which, error.discretisation, "1");
  print_figure("render.monte_carlo_noise", which, error.noise, "1");
  print_bands(which, error);
}

}  // namespace

void measure_transport() {
  constexpr double kPhotons = 1.6e6;
  ThreadTeam team(kThreads);
  for (const std::string name : {"torus", "figurine"}) {
    print_transport_error(name + "-collimated",
                          transport_error(name, true, elements_of(name, 0), kPhotons, team));
    auto sharp = elements_of(name, 0);
    sharp.single_scattering = true;
    print_transport_error(name + "-collimated-sharp",
                          transport_error(name, true, sharp, kPhotons, team));
    for (const auto& [directions, label] : kDirections) {
      const std::string which = fmt::format("{}-diffuse{}", name, label);
      auto options = elements_of(name, directions);
      print_transport_error(which, transport_error(name, false, options, kPhotons, team));
      options.boundary = BoundaryModel::kMilne;
      print_transport_error(which + "-milne",
                            transport_error(name, false, options, kPhotons, team));
    }
  }
}

void measure_radiance() {
  constexpr double kPhotons = 3.2e6;
  ThreadTeam team(kThreads);
  for (const std::string name : {"torus", "figurine"}) {
    for (const double degrees : {45.0, 90.0, 135.0}) {
      const auto which = fmt::format("{}-{}-degrees", name, degrees);
      const RadianceError error =
          radiance_error(name, degrees, elements_of(name, 0), kPhotons, team);
      print_figure("render.radiance_vs_monte_carlo", which, error.diffused, "1");
      print_figure("render.radiance_vs_monte_carlo", which + "-sharp", error.sharp, "1");
      print_figure("render.monte_carlo_noise", which, error.noise, "1");
    }
  }
}

void measure_directions() {
  constexpr int kMany = 64;
  ThreadTeam team(kThreads);
  for (const std::string name : {"torus", "figurine"}) {
    const auto solid = shape(name);
    const LitMarble reference(*solid, elements_of(name, kMany), team);
    for (const int directions : {0, 1, 2, 4, 8, 16}) {
      LitMarble marble(*solid, elements_of(name, directions), team);
      const std::string which = fmt::format("{}-{}", name, directions);
      print_figure("render.directions_error", which, marble.error_against(reference), "1");
      marble.set_tolerance(1e-3);
      print_figure("render.directions_frame_seconds", which, marble.frame_seconds(5), "s");
    }
  }
}

}  // namespace opaline::bench
