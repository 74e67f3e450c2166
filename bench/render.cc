#include <CLI/CLI.hpp>
#include <algorithm>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "base/log.h"
#include "bench/figure.h"
#include "bench/render/accuracy_figures.h"
#include "bench/render/dial_figures.h"
#include "bench/render/speed_figures.h"
#include "bench/stopwatch.h"

// render: how accurate and how fast the renderer's numerical ground is, as JSON lines. Groups of figures, all by default:
//   sphere     error against the exact solution of a lit sphere, graph, finite elements and polygrid
//   accuracy   a marbled torus and figurine's surface radiance for K = 1 and 0.1, and with two and four times as many elements, against finite
//              elements of a quarter of the size, and what those are still off (a third of what half the size differs from them)
//   geometry   where the error of elements of K = 0.1 comes from: the same facets with eight times as many elements, and what
//              those are off
//   transport  their exitance against Monte Carlo through the tetrahedra, split into model, discretisation and noise, with diffuse light
//              at the surface and followed; the model's by how many mean free paths thick the solid is there
//   radiance   the same of radiance at 45, 90 and 135 degrees from a collimated light, with single scattering left to diffusion and as itself
//   directions what few directions of diffuse light do to the radiance of each vertex, against 64 of them; processor seconds of a
//              picture's light
//   dials      processor seconds of one picture's light against its error, of the torus, for each method, size, K, tolerance and
//              precision, and with and without the correction of links that lean; which of them nothing beats, drawn where --plot says
//   mesh       seconds from a triangle mesh to a graph with its hierarchy; angles
//   frames     frames a second of the diffusion pass, a light moving 2 degrees a frame; processor seconds of one such frame on
//              one thread, which a busy machine hardly slows; iterations saved by warm starts, of the light and of a brush
//              (sigma_a times 1.1 in a ball of 4 mm a frame)
//   published  error against forty plain relaxation sweeps a level, in the processor time they take
//   raster     milliseconds of a whole frame through Vulkan at 1024 x 1024 of about 100 k triangles, light, shadow map and camera moving,
//              beside the solve; the share of it that sends the surface to the device and draws the shadow map
//   growth     processor time per node of a cold solve, from 100 k to 1 M nodes

namespace bench = opaline::bench;

int main(int argc, char** argv) try {
  std::string plot;
  bool is_drawn = true;
  const std::map<std::string, std::function<void()>> groups{
      {"accuracy", bench::measure_accuracy},
      {"geometry", bench::measure_geometry},
      {"transport", bench::measure_transport},
      {"radiance", bench::measure_radiance},
      {"directions", bench::measure_directions},
      {"dials", [&] { is_drawn = bench::measure_dials(plot); }},
      {"sphere", bench::measure_sphere},
      {"mesh", bench::measure_mesh},
      {"frames", bench::measure_frames},
      {"published", bench::measure_published},
      {"raster", bench::measure_raster},
      {"growth", bench::measure_growth}};
  std::string names;
  for (const auto& [name, measure] : groups) names += (names.empty() ? "" : ", ") + name;
  CLI::App app{
      "Accuracy and speed of the renderer's numerical ground.\n\nExample: scripts/bench render "
      "sphere mesh\nscripts/bench render dials --plot /tmp/dials.svg"};
  std::vector<std::string> chosen;
  app.add_option("groups", chosen, names + "; all by default");
  app.add_option("--plot", plot, "With dials: an SVG file for the front, and a .csv beside it");
  CLI11_PARSE(app, argc, argv);
  for (const auto& name : chosen) {
    if (groups.contains(name)) continue;
    opaline::log::error("no group \"{}\"; there are {}", name, names);
    return 2;
  }
  for (const auto& [name, measure] : groups) {
    if (chosen.empty() || std::ranges::find(chosen, name) != chosen.end()) measure();
  }
  bench::print_figure("render.peak_memory", "all", bench::peak_megabytes(), "MB");
  return is_drawn ? 0 : 1;
} catch (const std::exception& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return 1;
}
