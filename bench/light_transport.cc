#include <sys/resource.h>

#include <algorithm>
#include <chrono>
#include <thread>
#include <vector>

#include "base/log.h"
#include "bench/figure.h"
#include "sim/light_transport.h"
#include "sim/scene.h"

// light_transport: photons a second through the demo's marble (6 mm, heterogeneous, lit from behind, radiance to the
// camera and exitance tallied), all processors; medians of several rounds as JSON lines. A busy machine slows the first
// figure, hardly the second. The figure of merit, 1 / (relative variance of the radiance x CPU seconds), is what a faster
// step or more connections to the camera must raise.

namespace {

namespace bench = opaline::bench;
namespace log = opaline::log;
namespace sim = opaline::sim;
using opaline::Face;
using opaline::Material;
using opaline::Result;

constexpr int kRounds = 7;

struct Round {
  double per_second = 0.0;
  double per_cpu_second = 0.0;
  double merit = 0.0;  // 1/s
};

double cpu_seconds() {
  rusage usage{};
  ::getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_utime.tv_sec) +
         1e-6 * static_cast<double>(usage.ru_utime.tv_usec);
}

/// Sum of the variances over sum of the squared means, of all cells.
double relative_variance(const sim::TallyImage& radiance) {
  double light = 0.0;
  double noise = 0.0;
  for (const double mean : radiance.mean.samples()) light += mean * mean;
  for (const double variance : radiance.variance.samples()) noise += variance;
  return noise / light;
}

Result<Round> trace_round(const Material& marble, int round) {
  const sim::TransportOptions options{
      .photons = 1 << 20,
      .seed = 1,
      .stream = static_cast<std::uint64_t>(round),
      .radiance = sim::RadianceTally{Face::kZMax, sim::camera_above(marble.block, 300.0, 10.0)}};
  const sim::LightEntry entry = sim::patch_of_face(marble.block, Face::kZMin, 8, 8, 3, 4);
  const double cpu_start = cpu_seconds();
  const auto start = std::chrono::steady_clock::now();
  const auto tally = sim::trace(marble.block, marble.ior, marble.channels[1], entry, options, {});
  const std::chrono::duration<double> spent = std::chrono::steady_clock::now() - start;
  const double cpu = cpu_seconds() - cpu_start;
  if (!tally) return tally.error();
  const auto photons = static_cast<double>(tally->photons);
  return Round{
      photons / spent.count(), photons / cpu, 1.0 / (relative_variance(tally->radiance) * cpu)};
}

}  // namespace

int main() {
  const auto marble = sim::make_material({});
  if (!marble) return 1;
  std::vector<double> rates;
  std::vector<double> cpu_rates;
  std::vector<double> merits;
  for (int round = 0; round < kRounds; ++round) {
    const auto traced = trace_round(*marble, round);
    if (!traced) {
      log::error("{}", traced.error().message);
      return 1;
    }
    rates.push_back(traced->per_second);
    cpu_rates.push_back(traced->per_cpu_second);
    merits.push_back(traced->merit);
  }
  bench::print_figure("transport.photons_per_second", "marble", bench::median(rates), "photons/s");
  bench::print_figure(
      "transport.photons_per_cpu_second", "marble", bench::median(cpu_rates), "photons/s");
  bench::print_figure("transport.figure_of_merit", "marble", bench::median(merits), "1/s");
  bench::print_figure(
      "transport.threads", "marble", std::max(1U, std::thread::hardware_concurrency()), "1");
  bench::print_figure("transport.rounds", "marble", kRounds, "1");
  return 0;
}
