#include "bench/render/dial_figures.h"

#include <fmt/format.h>

#include <cstdio>
#include <tuple>
#include <utility>
#include <vector>

#include "bench/figure.h"
#include "bench/front.h"
#include "bench/render/radiance_error.h"
#include "bench/render/render_case.h"
#include "render/tetrahedra/stuffing.h"

namespace opaline::bench {
namespace {

/// A method, size and K, and what each tolerance makes of it: to 1e-4 in single precision, to 1e-6 in double.
void measure_dial(const std::string& group,
                  const std::string& which,
                  const render::SignedDistance& solid,
                  render::DiffusionOptions options,
                  const LitMarble& reference,
                  ThreadTeam& team,
                  std::vector<FrontPoint>& points) {
  constexpr int kFrames = 9;
  for (const auto& tolerances : {std::vector{1e-1, 1e-2, 1e-3, 1e-4}, {1e-6}}) {
    options.tolerance = tolerances.back();
    LitMarble marble(solid, options, team);
    if (tolerances.size() > 1)
      print_figure("render.dial_unknowns", which, static_cast<double>(marble.unknowns()), "1");
    for (const double tolerance : tolerances) {
      marble.set_tolerance(tolerance);
      FrontPoint point{fmt::format("{}-{:.0e}", which, tolerance), group};
      point.seconds = marble.frame_seconds(kFrames);
      point.error = marble.error_against(reference);
      print_figure("render.dial_frame_seconds", point.name, point.seconds, "s");
      print_figure("render.dial_error", point.name, point.error, "1");
      points.push_back(std::move(point));
    }
  }
}

}  // namespace

bool measure_dials(const std::string& plot) {
  ThreadTeam team(1);
  const auto solid = shape("torus");
  const double volume = render::estimate_volume(*solid);
  using enum render::Discretisation;
  const LitMarble reference(*solid,
                            {.method = kElements,
                             .directions = 0,
                             .spacing_mm = 0.5 * render::spacing_for(volume, 1.4e5),
                             .interior_growth = 0.0,
                             .tolerance = 1e-8},
                            team);
  std::vector<FrontPoint> points;
  for (const auto& [name, method, corrections] : {std::tuple{"elements", kElements, 0},
                                                  {"graph", kGraph, 8},
                                                  {"two_point", kGraph, 0},
                                                  {"polygrid", kPolygrid, 0}})
    for (const auto& [size, tets] : {std::pair{"30k", 3e4}, {"140k", 1.4e5}})
      for (const auto& [k, growth] : {std::pair{"K0.1", 0.1}, {"K1", 1.0}})
        measure_dial(name,
                     fmt::format("{}-{}-{}", name, size, k),
                     *solid,
                     {.method = method,
                      .directions = 0,
                      .spacing_mm = render::spacing_for(volume, tets),
                      .interior_growth = growth,
                      .corrections = corrections},
                     reference,
                     team,
                     points);
  for (const int levels : {1, 2, 3})  // of the hierarchy; all it has are above
    measure_dial(fmt::format("{} level{}", levels, levels > 1 ? "s" : ""),
                 fmt::format("elements-140k-K0.1-L{}", levels),
                 *solid,
                 {.method = kElements,
                  .directions = 0,
                  .spacing_mm = render::spacing_for(volume, 1.4e5),
                  .interior_growth = 0.1,
                  .max_iterations = 3000,
                  .levels = levels},
                 reference,
                 team,
                 points);
  for (const FrontPoint& point : front_of(points))
    print_figure("render.dial_front", point.name, point.error, "1");
  if (plot.empty()) return true;
  const auto drawn =
      draw_front(points, "processor seconds of one picture's light", "error of radiance, %", plot);
  if (!drawn) std::fputs((drawn.error().message + "\n").c_str(), stderr);
  return drawn.has_value();
}

}  // namespace opaline::bench
