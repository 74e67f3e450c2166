#include <chrono>
#include <vector>

#include "base/log.h"
#include "bench/figure.h"
#include "sim/light_transport.h"
#include "sim/scene.h"

// light_transport: photons a second through the demo's marble (6 mm, heterogeneous, lit from behind, radiance to the
// camera and exitance tallied), all processors; median of several rounds, one JSON line.

namespace {

using namespace opaline;

constexpr int kRounds = 7;

Result<double> photons_per_second(const Material& marble, int round) {
  const sim::TransportOptions options{
      .photons = 1 << 20,
      .seed = 1,
      .stream = static_cast<std::uint64_t>(round),
      .radiance = sim::RadianceTally{Face::kZMax, sim::camera_above(marble.block, 300.0, 10.0)}};
  const sim::LightEntry entry = sim::patch_of_face(marble.block, Face::kZMin, 8, 8, 3, 4);
  const auto start = std::chrono::steady_clock::now();
  const auto tally = sim::trace(marble.block, marble.ior, marble.channels[1], entry, options, {});
  const std::chrono::duration<double> spent = std::chrono::steady_clock::now() - start;
  if (!tally) return tally.error();
  return static_cast<double>(tally->photons) / spent.count();
}

}  // namespace

int main() {
  const auto marble = sim::make_material({});
  if (!marble) return 1;
  std::vector<double> rates;
  for (int round = 0; round < kRounds; ++round) {
    const auto rate = photons_per_second(*marble, round);
    if (!rate) {
      log::error("{}", rate.error().message);
      return 1;
    }
    rates.push_back(*rate);
  }
  bench::print_figure("transport.photons_per_second", "marble", bench::median(rates), "photons/s");
  bench::print_figure("transport.rounds", "marble", kRounds, "1");
  return 0;
}
