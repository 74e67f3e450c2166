#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <string>
#include <tuple>
#include <vector>

#include "base/log.h"
#include "bench/figure.h"
#include "bench/render/radiance_error.h"
#include "bench/render/raster_frame.h"
#include "bench/render/render_case.h"
#include "bench/render/sphere_error.h"
#include "bench/render/transport_error.h"
#include "bench/stopwatch.h"
#include "render/graph/relaxation.h"
#include "render/mesh/mesh_distance.h"
#include "render/tetrahedra/stuffing.h"

// render: how accurate and how fast the renderer's numerical ground is, as JSON lines. Groups of figures, all by default:
//   sphere     error against the exact solution of a lit sphere, graph, finite elements and polygrid
//   accuracy   a marbled torus and figurine's surface radiance for K = 1 and 0.1 against finite elements of half the size, 8 times
//              as many, and what those themselves are still off (a third of what they differ from the same size, uniform)
//   transport  their exitance against Monte Carlo through the tetrahedra, split into model, discretisation and noise
//   dials      processor seconds of one picture's light against its error, of the torus, for each method, size, K, tolerance and
//              precision, and with and without the correction of links that lean
//   mesh       seconds from a triangle mesh to a graph with its hierarchy; angles
//   frames     frames a second of the diffusion pass, a light moving 2 degrees a frame; processor seconds of one such frame on
//              one thread, which a busy machine hardly slows; iterations saved by warm starts, of the light and of a brush
//              (sigma_a times 1.1 in a ball of 4 mm a frame)
//   published  error against forty plain relaxation sweeps a level, in the processor time they take
//   raster     milliseconds of a whole frame through Vulkan at 1024 x 1024 of about 100 k triangles, light, shadow map and camera moving,
//              beside the solve; the share of it that sends the surface to the device and draws the shadow map
//   growth     processor time per node of a cold solve, from 100 k to 1 M nodes

namespace {

namespace bench = opaline::bench;
namespace render = opaline::render;
using opaline::ThreadTeam;
using opaline::reconstruct::diffusion::BoundaryModel;

constexpr double kTolerance = 1e-3;
constexpr int kThreads = 2;
constexpr int kRemembered = 4;

void measure_sphere() {
  ThreadTeam team(kThreads);
  const auto sphere = bench::shape("sphere");
  for (const auto& [name, tets] : {std::pair{"13k", 13e3}, std::pair{"52k", 52e3}}) {
    const render::TetMesh mesh = bench::cut(*sphere, tets);
    bench::print_figure("render.sphere_tets", name, static_cast<double>(mesh.tets.size()), "1");
    bench::print_figure("render.sphere_rms_graph", name, bench::graph_error(mesh, 20, team), "1");
    bench::print_figure(
        "render.sphere_rms_two_point", name, bench::graph_error(mesh, 0, team), "1");
    bench::print_figure("render.sphere_rms_fem", name, bench::elements_error(mesh, team), "1");
  }
  for (const auto& [name, spacing] : {std::pair{"h1.25", 1.25}, std::pair{"h0.8", 0.8}}) {
    bench::print_figure(
        "render.sphere_rms_polygrid", name, bench::polygrid_error(*sphere, spacing, team), "1");
  }
}

void measure_accuracy() {
  ThreadTeam team(kThreads);
  for (const char* name : {"torus", "figurine"}) {
    const auto solid = bench::shape(name);
    const double spacing = render::spacing_for(render::estimate_volume(*solid), 1.4e5);
    const auto lit = [&](render::Discretisation method, double size, double growth) {
      return bench::LitMarble(
          *solid,
          {.method = method, .spacing_mm = size, .interior_growth = growth, .tolerance = 1e-8},
          team);
    };
    using enum render::Discretisation;
    const bench::LitMarble reference = lit(kElements, 0.5 * spacing, 0.0);
    bench::print_figure("render.reference_error_estimate",
                        name,
                        lit(kElements, spacing, 0.0).error_against(reference) / 3.0,
                        "1");
    for (const auto& [growth, k] : {std::pair{1.0, "K1"}, std::pair{0.1, "K0.1"}}) {
      for (const auto& [method, what] : {std::pair{kGraph, "graph"}, std::pair{kElements, "fem"}}) {
        const bench::LitMarble marble = lit(method, spacing, growth);
        const std::string which = std::string(name) + "-" + k + "-" + what;
        bench::print_figure("render.error_vs_fem", which, marble.error_against(reference), "1");
        bench::print_figure(
            "render.error_vs_fem_tets", which, static_cast<double>(marble.tetrahedra()), "1");
      }
    }
  }
}

/// Where the error of elements of K = 0.1 comes from: the same facets with eight times as many elements, and what those are off.
void measure_geometry() {
  ThreadTeam team(kThreads);
  for (const char* name : {"torus", "figurine"}) {
    const auto solid = bench::shape(name);
    const double spacing = render::spacing_for(render::estimate_volume(*solid), 1.4e5);
    const render::DiffusionOptions options{.spacing_mm = spacing, .tolerance = 1e-8};
    render::DiffusionOptions finer = options;
    finer.spacing_mm = 0.5 * spacing;
    finer.interior_growth = 0.0;
    const bench::LitMarble reference(*solid, finer, team);
    const render::TetMesh mesh = bench::cut(*solid, 1.4e5, 0.1);
    const bench::LitMarble coarse(mesh, *solid, options, team);
    const bench::LitMarble same_facets(bench::cut_into_eight(mesh), *solid, options, team);
    const std::string which(name);
    bench::print_figure("render.error_vs_fem", which, coarse.error_against(reference), "1");
    bench::print_figure("render.error_of_elements", which, coarse.error_against(same_facets), "1");
    bench::print_figure("render.error_of_facets", which, same_facets.error_against(reference), "1");
  }
}

/// One method and size, and what each tolerance makes of it.
void measure_dial(const std::string& which,
                  const render::SignedDistance& solid,
                  render::DiffusionOptions options,
                  const bench::LitMarble& reference,
                  ThreadTeam& team) {
  constexpr int kFrames = 9;
  for (const auto& [tolerances, precision] :
       {std::pair{std::vector{1e-1, 1e-2, 1e-3, 1e-4}, "single"}, {std::vector{1e-6}, "double"}}) {
    options.tolerance = tolerances.back();
    bench::LitMarble marble(solid, options, team);
    if (precision == std::string("single")) {
      bench::print_figure(
          "render.dial_unknowns", which, static_cast<double>(marble.unknowns()), "1");
    }
    for (const double tolerance : tolerances) {
      marble.set_tolerance(tolerance);
      const double seconds = marble.frame_seconds(kFrames);
      const std::string name = fmt::format("{}-{:.0e}", which, tolerance);
      bench::print_figure("render.dial_frame_seconds", name, seconds, "s");
      bench::print_figure("render.dial_error", name, marble.error_against(reference), "1");
    }
  }
}

void measure_dials() {
  ThreadTeam team(1);
  const auto solid = bench::shape("torus");
  const double volume = render::estimate_volume(*solid);
  using enum render::Discretisation;
  const bench::LitMarble reference(*solid,
                                   {.method = kElements,
                                    .spacing_mm = 0.5 * render::spacing_for(volume, 1.4e5),
                                    .interior_growth = 0.0,
                                    .tolerance = 1e-8},
                                   team);
  for (const auto& [name, method, corrections] : {std::tuple{"elements", kElements, 0},
                                                  {"graph", kGraph, 8},
                                                  {"two_point", kGraph, 0},
                                                  {"polygrid", kPolygrid, 0}}) {
    for (const auto& [size, tets] : {std::pair{"30k", 3e4}, {"140k", 1.4e5}}) {
      for (const auto& [k, growth] : {std::pair{"K0.1", 0.1}, {"K1", 1.0}}) {
        if (method == kPolygrid && growth == 1.0) continue;  // its lattice has one size
        measure_dial(fmt::format("{}-{}-{}", name, size, k),
                     *solid,
                     {.method = method,
                      .spacing_mm = render::spacing_for(volume, tets),
                      .interior_growth = growth,
                      .corrections = corrections},
                     reference,
                     team);
      }
    }
  }
}

void measure_transport() {
  constexpr double kPhotons = 1.6e6;
  ThreadTeam team(kThreads);
  for (const char* name : {"torus", "figurine"}) {
    const double spacing = render::spacing_for(render::estimate_volume(*bench::shape(name)), 1.4e5);
    for (const auto& [collimated, light] :
         {std::pair{false, "diffuse"}, std::pair{true, "collimated"}}) {
      const auto error = bench::transport_error(name,
                                                collimated,
                                                {.method = render::Discretisation::kElements,
                                                 .spacing_mm = spacing,
                                                 .interior_growth = 0.1,
                                                 .tolerance = 1e-8},
                                                kPhotons,
                                                team);
      const std::string which = std::string(name) + "-" + light;
      bench::print_figure("render.error_vs_monte_carlo", which, error.total, "1");
      bench::print_figure("render.model_error", which, error.model, "1");
      bench::print_figure("render.discretisation_error", which, error.discretisation, "1");
      bench::print_figure("render.monte_carlo_noise", which, error.noise, "1");
      if (collimated) continue;
      const auto milne = bench::transport_error(name,
                                                false,
                                                {.method = render::Discretisation::kElements,
                                                 .spacing_mm = spacing,
                                                 .interior_growth = 0.1,
                                                 .tolerance = 1e-8,
                                                 .boundary = BoundaryModel::kMilne},
                                                kPhotons,
                                                team);
      bench::print_figure("render.error_vs_monte_carlo", which + "-milne", milne.total, "1");
      bench::print_figure("render.model_error", which + "-milne", milne.model, "1");
    }
  }
}

void measure_mesh() {
  ThreadTeam team(kThreads);
  const render::TriangleMesh surface =
      render::surface_mesh(bench::cut(*bench::shape("torus"), 1.3e6));
  bench::print_figure(
      "render.mesh_triangles", "torus", static_cast<double>(surface.triangles.size()), "1");
  const bench::Stopwatch watch;
  const auto solid = render::MeshDistance::create(surface);
  if (!solid) return opaline::log::error("{}", solid.error().message);
  const render::TetMesh mesh = bench::cut(**solid, 1e5);
  const bench::LitObject object(mesh, team, 0);
  bench::print_figure("render.mesh_seconds", "torus", watch.seconds(), "s");
  bench::print_figure("render.mesh_cpu_seconds", "torus", watch.cpu(), "s");
  bench::print_figure("render.mesh_tets", "torus", static_cast<double>(mesh.tets.size()), "1");
  bench::print_figure(
      "render.smallest_dihedral", "uniform", render::quality_of(mesh).smallest_dihedral, "degrees");
  for (const auto& [name, growth] : {std::pair{"K0.1", 0.1}, std::pair{"K1", 1.0}}) {
    const auto graded = render::quality_of(bench::cut(*bench::shape("sphere"), 5e5, growth));
    bench::print_figure("render.smallest_dihedral", name, graded.smallest_dihedral, "degrees");
    bench::print_figure("render.graded_tets", name, static_cast<double>(graded.tets), "1");
  }
}

constexpr double kStep = 2.0;  // degrees a frame

void measure_frame_rate(const render::TetMesh& mesh) {
  constexpr int kFrames = 61;
  ThreadTeam team(kThreads);
  bench::LitObject object(mesh, team, kRemembered);
  object.frame(0.0, kTolerance, true);
  std::vector<double> seconds;
  double worst = 0.0;
  for (int f = 1; f < kFrames; ++f) {
    const bench::Stopwatch watch;
    const auto summary = object.frame(kStep * f, kTolerance, false);
    seconds.push_back(watch.seconds());
    worst = std::max(worst, summary.relative_residual);
  }
  bench::print_figure("render.diffusion_fps", "140k", 1.0 / bench::median(seconds), "frames/s");
  bench::print_figure("render.diffusion_residual", "140k", worst, "1");
}

void print_gain(const char* which, int cold, int iterations, int frames) {
  const double warm = static_cast<double>(iterations) / frames;
  bench::print_figure("render.warm_iterations", which, warm, "1");
  bench::print_figure("render.warm_start_gain", which, cold / std::max(warm, 1.0 / frames), "1");
}

void measure_warm_starts(const render::TetMesh& mesh) {
  constexpr int kFrames = 30;
  ThreadTeam team(1);
  bench::LitObject object(mesh, team, kRemembered);
  const int cold = object.frame(0.0, kTolerance, true).iterations;
  bench::print_figure("render.cold_iterations", "140k", cold, "1");
  std::vector<double> seconds;
  int iterations = 0;
  for (int f = 1; f <= kFrames; ++f) {
    const bench::Stopwatch watch;
    iterations += object.frame(kStep * f, kTolerance, false).iterations;
    seconds.push_back(watch.cpu());
  }
  bench::print_figure("render.diffusion_cpu_seconds", "140k", bench::median(seconds), "s");
  print_gain("light", cold, iterations, kFrames);
  object.frame(0.0, kTolerance, true);
  iterations = 0;
  for (int f = 0; f < kFrames; ++f) {
    object.paint({7.5 * std::cos(0.1 * f), 7.5 * std::sin(0.1 * f), 1.0}, 1.1);
    iterations += object.frame(0.0, kTolerance, false).iterations;
  }
  print_gain("edit", cold, iterations, kFrames);
}

void measure_frames() {
  const render::TetMesh mesh = bench::cut(*bench::shape("torus"), 1.4e5);
  bench::print_figure("render.diffusion_nodes", "140k", static_cast<double>(mesh.tets.size()), "1");
  measure_frame_rate(mesh);
  measure_warm_starts(mesh);
}

void measure_raster() {
  const bench::RasterFrame frame = bench::raster_frame();
  bench::print_figure("render.frame_triangles", "100k", static_cast<double>(frame.triangles), "1");
  bench::print_figure("render.frame_ms", "100k", frame.whole_ms, "ms");
  bench::print_figure("render.frame_cpu_ms", "100k", frame.whole_cpu_ms, "ms");
  bench::print_figure("render.frame_take_ms", "100k", frame.take_ms, "ms");
  bench::print_figure("render.frame_draw_ms", "100k", frame.draw_ms, "ms");
}

double relative_difference(const std::vector<render::Lanes<float>>& a,
                           const std::vector<render::Lanes<float>>& b) {
  double difference = 0.0;
  double size = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    for (int c = 0; c < 3; ++c) {
      difference += std::pow(a[i][c] - b[i][c], 2);
      size += std::pow(b[i][c], 2);
    }
  }
  return std::sqrt(difference / size);
}

void measure_published() {
  constexpr int kSweeps = 40;
  ThreadTeam team(1);
  const auto solid = bench::shape("torus");
  std::vector<render::QuadGraph> graphs;
  for (const double tets :
       {1.4e5 / 64.0, 1.4e5 / 8.0, 1.4e5}) {  // a quarter of the surface nodes at each
    graphs.push_back(render::make_quad_graph(bench::cut(*solid, tets)));
  }
  const render::QuadGraph* const levels[]{&graphs[0], &graphs[1], &graphs[2]};
  render::Relaxation relaxation(
      levels, bench::marbled_optics, bench::render_boundary(), render::GraphWeights::kTwoPoint);
  const auto q = [](const auto& node) { return bench::light_around(node, 0.0)[0]; };
  std::vector<double> seconds;
  for (int round = 0; round < 3; ++round) {
    const bench::Stopwatch watch;
    relaxation.solve(q, kSweeps, team);
    seconds.push_back(watch.cpu());
  }
  const double allowed = bench::median(seconds);
  bench::LitObject object(bench::cut(*solid, 1.4e5), team, 0);
  object.frame(0.0, 1e-6, true);
  const auto exact = object.fluence();
  const double published = relative_difference(relaxation.inner(), exact);
  double ours = 1.0;
  double spent = 0.0;
  for (const double tolerance :
       {1e-1, 3e-2, 1e-2, 3e-3, 1e-3, 3e-4, 1e-4}) {  // the best that fits into the time
    const bench::Stopwatch watch;
    object.frame(0.0, tolerance, true);
    const double took = watch.cpu();
    if (took > allowed) break;
    spent = took;
    ours = relative_difference(object.fluence(), exact);
  }
  bench::print_figure("render.published_seconds", "140k", allowed, "s");
  bench::print_figure("render.published_error", "140k", published, "1");
  bench::print_figure("render.seconds_at_most_published", "140k", spent, "s");
  bench::print_figure("render.error_at_most_published", "140k", ours, "1");
  bench::print_figure("render.error_ratio_vs_published", "140k", published / ours, "1");
}

void measure_growth() {
  ThreadTeam team(1);
  std::map<std::string, double> cost;
  for (const auto& [name, tets] : {std::pair{"100k", 1e5}, std::pair{"1M", 1e6}}) {
    bench::LitObject object(bench::cut(*bench::shape("torus"), tets), team, 0);
    std::vector<double> seconds;
    int iterations = 0;
    for (int round = 0; round < 5; ++round) {
      const bench::Stopwatch watch;
      iterations = object.frame(0.0, kTolerance, true).iterations;
      seconds.push_back(watch.cpu());
    }
    cost[name] = 1e9 * bench::median(seconds) / static_cast<double>(object.graph().inner.size());
    bench::print_figure("render.nanoseconds_per_node", name, cost[name], "ns");
    bench::print_figure("render.cold_iterations", name, iterations, "1");
  }
  bench::print_figure("render.cost_growth", "100k-1M", cost["1M"] / cost["100k"], "1");
}

}  // namespace

int main(int argc, char** argv) try {
  const std::map<std::string, std::function<void()>> groups{{"accuracy", measure_accuracy},
                                                            {"geometry", measure_geometry},
                                                            {"transport", measure_transport},
                                                            {"dials", measure_dials},
                                                            {"sphere", measure_sphere},
                                                            {"mesh", measure_mesh},
                                                            {"frames", measure_frames},
                                                            {"published", measure_published},
                                                            {"raster", measure_raster},
                                                            {"growth", measure_growth}};
  CLI::App app{
      "Accuracy and speed of the renderer's numerical ground.\n\nExample: scripts/bench render "
      "sphere mesh"};
  std::vector<std::string> chosen;
  app.add_option("groups",
                 chosen,
                 "accuracy, dials, transport, sphere, mesh, frames, published, raster, growth; all "
                 "by default");
  CLI11_PARSE(app, argc, argv);
  for (const auto& name : chosen) {
    if (groups.contains(name)) continue;
    opaline::log::error(
        "no group \"{}\"; there are accuracy, dials, transport, sphere, mesh, frames, published, "
        "raster, growth",
        name);
    return 2;
  }
  for (const auto& [name, measure] : groups) {
    if (chosen.empty() || std::ranges::find(chosen, name) != chosen.end()) measure();
  }
  bench::print_figure("render.peak_memory", "all", bench::peak_megabytes(), "MB");
  return 0;
} catch (const std::exception& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return 1;
}
