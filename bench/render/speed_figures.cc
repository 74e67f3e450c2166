#include "bench/render/speed_figures.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <string>
#include <vector>

#include "base/log.h"
#include "bench/figure.h"
#include "bench/render/raster_frame.h"
#include "bench/render/render_case.h"
#include "bench/stopwatch.h"
#include "render/graph/relaxation.h"
#include "render/mesh/mesh_distance.h"
#include "render/tetrahedra/stuffing.h"

namespace opaline::bench {
namespace {

constexpr double kTolerance = 1e-3;
constexpr int kThreads = 2;
constexpr int kRemembered = 4;

constexpr double kStep = 2.0;  // degrees a frame

void measure_frame_rate(const render::TetMesh& mesh) {
  constexpr int kFrames = 61;
  ThreadTeam team(kThreads);
  LitObject object(mesh, team, kRemembered);
  object.frame(0.0, kTolerance, true);
  std::vector<double> seconds;
  double worst = 0.0;
  for (int f = 1; f < kFrames; ++f) {
    const Stopwatch watch;
    const auto summary = object.frame(kStep * f, kTolerance, false);
    seconds.push_back(watch.seconds());
    worst = std::max(worst, summary.relative_residual);
  }
  print_figure("render.diffusion_fps", "140k", 1.0 / median(seconds), "frames/s");
  print_figure("render.diffusion_residual", "140k", worst, "1");
}

void print_gain(const char* which, int cold, int iterations, int frames) {
  const double warm = static_cast<double>(iterations) / frames;
  print_figure("render.warm_iterations", which, warm, "1");
  print_figure("render.warm_start_gain", which, cold / std::max(warm, 1.0 / frames), "1");
}

void measure_warm_starts(const render::TetMesh& mesh) {
  constexpr int kFrames = 30;
  ThreadTeam team(1);
  LitObject object(mesh, team, kRemembered);
  const int cold = object.frame(0.0, kTolerance, true).iterations;
  print_figure("render.cold_iterations", "140k", cold, "1");
  std::vector<double> seconds;
  int iterations = 0;
  for (int f = 1; f <= kFrames; ++f) {
    const Stopwatch watch;
    iterations += object.frame(kStep * f, kTolerance, false).iterations;
    seconds.push_back(watch.cpu());
  }
  print_figure("render.diffusion_cpu_seconds", "140k", median(seconds), "s");
  print_gain("light", cold, iterations, kFrames);
  object.frame(0.0, kTolerance, true);
  iterations = 0;
  for (int f = 0; f < kFrames; ++f) {
    object.paint({7.5 * std::cos(0.1 * f), 7.5 * std::sin(0.1 * f), 1.0}, 1.1);
    iterations += object.frame(0.0, kTolerance, false).iterations;
  }
  print_gain("edit", cold, iterations, kFrames);
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

}  // namespace

void measure_mesh() {
  ThreadTeam team(kThreads);
  const render::TriangleMesh surface = render::surface_mesh(cut(*shape("torus"), 1.3e6));
  print_figure(
      "render.mesh_triangles", "torus", static_cast<double>(surface.triangles.size()), "1");
  const Stopwatch watch;
  const auto solid = render::MeshDistance::create(surface);
  if (!solid) return opaline::log::error("{}", solid.error().message);
  const render::TetMesh mesh = cut(**solid, 1e5);
  const LitObject object(mesh, team, 0);
  print_figure("render.mesh_seconds", "torus", watch.seconds(), "s");
  print_figure("render.mesh_cpu_seconds", "torus", watch.cpu(), "s");
  print_figure("render.mesh_tets", "torus", static_cast<double>(mesh.tets.size()), "1");
  print_figure(
      "render.smallest_dihedral", "uniform", render::quality_of(mesh).smallest_dihedral, "degrees");
  for (const auto& [name, growth] : {std::pair{"K0.1", 0.1}, std::pair{"K1", 1.0}}) {
    const auto graded = render::quality_of(cut(*shape("sphere"), 5e5, growth));
    print_figure("render.smallest_dihedral", name, graded.smallest_dihedral, "degrees");
    print_figure("render.graded_tets", name, static_cast<double>(graded.tets), "1");
  }
}

void measure_frames() {
  const render::TetMesh mesh = cut(*shape("torus"), 1.4e5);
  print_figure("render.diffusion_nodes", "140k", static_cast<double>(mesh.tets.size()), "1");
  measure_frame_rate(mesh);
  measure_warm_starts(mesh);
}

void measure_raster() {
  const RasterFrame frame = raster_frame();
  print_figure("render.frame_triangles", "100k", static_cast<double>(frame.triangles), "1");
  print_figure("render.frame_ms", "100k", frame.whole_ms, "ms");
  print_figure("render.frame_cpu_ms", "100k", frame.whole_cpu_ms, "ms");
  print_figure("render.frame_take_ms", "100k", frame.take_ms, "ms");
  print_figure("render.frame_draw_ms", "100k", frame.draw_ms, "ms");
}

void measure_published() {
  constexpr int kSweeps = 40;
  ThreadTeam team(1);
  const auto solid = shape("torus");
  std::vector<render::QuadGraph> graphs;
  for (const double tets :
       {1.4e5 / 64.0, 1.4e5 / 8.0, 1.4e5}) {  // a quarter of the surface nodes at each
    graphs.push_back(render::make_quad_graph(cut(*solid, tets)));
  }
  const render::QuadGraph* const levels[]{&graphs[0], &graphs[1], &graphs[2]};
  render::Relaxation relaxation(
      levels, marbled_optics, render_boundary(), render::GraphWeights::kTwoPoint);
  const auto q = [](const auto& node) { return light_around(node, 0.0)[0]; };
  std::vector<double> seconds;
  for (int round = 0; round < 3; ++round) {
    const Stopwatch watch;
    relaxation.solve(q, kSweeps, team);
    seconds.push_back(watch.cpu());
  }
  const double allowed = median(seconds);
  LitObject object(cut(*solid, 1.4e5), team, 0);
  object.frame(0.0, 1e-6, true);
  const auto exact = object.fluence();
  const double published = relative_difference(relaxation.inner(), exact);
  double ours = 1.0;
  double spent = 0.0;
  for (const double tolerance :
       {1e-1, 3e-2, 1e-2, 3e-3, 1e-3, 3e-4, 1e-4}) {  // the best that fits into the time
    const Stopwatch watch;
    object.frame(0.0, tolerance, true);
    const double took = watch.cpu();
    if (took > allowed) break;
    spent = took;
    ours = relative_difference(object.fluence(), exact);
  }
  print_figure("render.published_seconds", "140k", allowed, "s");
  print_figure("render.published_error", "140k", published, "1");
  print_figure("render.seconds_at_most_published", "140k", spent, "s");
  print_figure("render.error_at_most_published", "140k", ours, "1");
  print_figure("render.error_ratio_vs_published", "140k", published / ours, "1");
}

void measure_growth() {
  constexpr int kRounds = 9;
  ThreadTeam team(1);
  LitObject small(cut(*shape("torus"), 1e5), team, 0);
  LitObject large(cut(*shape("torus"), 1e6), team, 0);
  std::map<std::string, std::vector<double>> cost;
  std::map<std::string, int> iterations;
  for (int round = 0; round < kRounds;
       ++round) {  // in turn, so that both meet the same disturbances
    for (const auto& [name, object] : {std::pair{"100k", &small}, std::pair{"1M", &large}}) {
      object->frame(0.0, kTolerance, true);  // caches are its own
      const Stopwatch watch;
      iterations[name] = object->frame(0.0, kTolerance, true).iterations;
      cost[name].push_back(1e9 * watch.cpu() / static_cast<double>(object->graph().inner.size()));
    }
    cost["growth"].push_back(cost["1M"].back() / cost["100k"].back());
  }
  for (const auto* name : {"100k", "1M"}) {
    print_figure("render.nanoseconds_per_node", name, median(cost[name]), "ns");
    print_figure("render.cold_iterations", name, iterations[name], "1");
  }
  print_figure("render.cost_growth", "100k-1M", median(cost["growth"]), "1");
}

}  // namespace opaline::bench
