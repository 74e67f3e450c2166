// Traces the table that reconstruct/spherical_gradient/ball_table.inc holds: what balls of many albedos and curvatures show under
// constant and gradient light. About ten minutes on two cores; its rows do not depend on how many there are.

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <array>
#include <cmath>
#include <cstdio>
#include <exception>
#include <thread>

#include "sim/ball_transport.h"

namespace opaline::bench {
namespace {

constexpr std::array kAlbedos{0.5, 0.7, 0.8, 0.9, 0.95, 0.98, 0.99, 0.995, 0.998, 0.999};
constexpr std::array kCurvatures{0.0, 0.03, 0.05, 0.08, 0.12, 0.2, 0.3, 0.4, 0.5};  // k l_d
constexpr double kFlat = 1e5;  // mean free paths: the radius of what is flat

struct Arguments {
  double ior = 1.4;
  std::int64_t paths = 2'000'000;
  std::uint64_t seed = 1;
};

void print_row(const Arguments& arguments, double albedo, double curvature, ThreadTeam& team) {
  const double decay = std::sqrt(3.0 * (1.0 - albedo));  // l_d = 1 / decay mean free paths
  const double radius = curvature > 0.0 ? 1.0 / (decay * curvature) : kFlat;
  if (radius < 1.0) return;
  const auto light =
      sim::trace_ball({albedo, radius, arguments.ior}, arguments.paths, arguments.seed, team);
  if (!light) throw std::runtime_error(light.error().message);
  fmt::print("    {{{}, {}, {:.6f}, {:.6f}, {:.6f}, {:.6f}}},\n",
             albedo,
             curvature,
             light->reflectance,
             light->reflectance_deviation,
             light->ratio,
             light->ratio_deviation);
  std::fflush(stdout);
}

}  // namespace
}  // namespace opaline::bench

int main(int argc, char** argv) try {
  namespace bench = opaline::bench;
  bench::Arguments arguments;
  CLI::App app{
      "Traces the table of balls under constant and gradient light: albedo, curvature times "
      "translucency, reflectance and\n"
      "its deviation, ratio and its deviation, a row a ball.\n\nExample: scripts/bench ball_table "
      "> "
      "reconstruct/spherical_gradient/ball_table.inc"};
  app.add_option("--ior", arguments.ior, "Refractive index")->capture_default_str();
  app.add_option("--paths", arguments.paths, "A ball")->capture_default_str();
  app.add_option("--seed", arguments.seed, "Of all balls")->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  opaline::ThreadTeam team(static_cast<int>(std::max(1U, std::thread::hardware_concurrency())));
  for (const double albedo : bench::kAlbedos)
    for (const double curvature : bench::kCurvatures)
      bench::print_row(arguments, albedo, curvature, team);
  return 0;
} catch (const std::exception& error) {
  std::fputs(error.what(), stderr);
  return 1;
}
