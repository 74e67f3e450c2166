// Scattering parameters of curved surfaces from four pictures (Zhu et al. 2013): how far the formulas, the paper's own and the table of
// traced balls are from balls traced anew, whether the stated deviations hold, and how long the maps of ten megapixels take.

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <cstdio>
#include <exception>
#include <functional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "bench/led/ball_figures.h"
#include "bench/led/map_time.h"
#include "bench/led/stage_figures.h"
#include "bench/led/tradeoff.h"

int main(int argc, char** argv) try {
  namespace bench = opaline::bench;
  std::int64_t paths = 2'000'000;
  bool tradeoff = false;
  bool blobs = false;
  std::string plot;
  std::string body;
  std::string part;
  CLI::App app{
      "Scattering parameters from four pictures: errors, coverage, time.\n\nExamples: "
      "scripts/bench "
      "led_sphere --paths 500000\n  scripts/bench led_sphere --blobs --body blob_b\n  "
      "scripts/bench "
      "led_sphere --tradeoff --plot /tmp/front.svg"};
  app.add_option("--paths", paths, "A traced ball")->check(CLI::Range(10'000, 1'000'000'000));
  app.add_option("--part", part, "Only formulas, materials, beams, noise, stage, extremes or time")
      ->check(
          CLI::IsMember({"formulas", "materials", "beams", "noise", "stage", "extremes", "time"}));
  app.add_flag("--tradeoff",
               tradeoff,
               "Only lamps, exposures, smoothing and estimator against error and time");
  app.add_flag("--blobs", blobs, "Only smooth blobs and dents");
  app.add_option("--body", body, "With --blobs: only this one");
  app.add_option(
      "--plot", plot, "With --tradeoff: an SVG file for the front, and a .csv beside it");
  CLI11_PARSE(app, argc, argv);
  opaline::ThreadTeam team(static_cast<int>(std::max(1U, std::thread::hardware_concurrency())));
  if (tradeoff) return bench::measure_tradeoff(std::min<std::int64_t>(paths, 500'000), plot, team);
  const std::int64_t a_pixel = std::clamp<std::int64_t>(paths / 4000, 32, 4000);
  if (blobs) {
    bench::measure_blobs(team, a_pixel, body);
    return 0;
  }
  const std::vector<std::pair<std::string, std::function<void()>>> parts{
      {"formulas", [] { bench::measure_formulas(); }},
      {"materials", [&] { bench::measure_materials(team, paths); }},
      {"beams", [&] { bench::measure_beams(team, std::min<std::int64_t>(paths, 500'000)); }},
      {"noise", [&] { bench::measure_noise(team, paths); }},
      {"stage", [&] { bench::measure_stage(team, std::min<std::int64_t>(paths, 1'000'000)); }},
      {"blobs", [&] { bench::measure_blobs(team, a_pixel, {}); }},
      {"extremes", [&] { bench::measure_extremes(team, std::min<std::int64_t>(paths, 300'000)); }},
      {"time", [&] { bench::measure_time(team); }}};
  for (const auto& [name, measure] : parts)
    if (part.empty() || part == name) measure();
  return 0;
} catch (const std::exception& error) {
  std::fputs(error.what(), stderr);
  return 1;
}
