#include "bench/inverse/material_error.h"

#include <fmt/format.h>

#include <cmath>
#include <vector>

#include "base/channel.h"
#include "bench/figure.h"

namespace opaline::bench {
namespace {

constexpr double kDepth = 3.0;  // mm

std::vector<std::size_t> cells_near(const Block& block, Face face) {
  const auto axis = static_cast<std::size_t>(axis_of(face));
  const double h = block.spacing()[axis];
  const int depth = block.cells()[axis];
  std::vector<std::size_t> cells;
  for (int k = 0; k < block.nz; ++k)
    for (int j = 0; j < block.ny; ++j)
      for (int i = 0; i < block.nx; ++i) {
        const int along = axis == 0 ? i : axis == 1 ? j : k;
        const int under = is_max(face) ? depth - 1 - along : along;
        if ((under + 0.5) * h < kDepth) cells.push_back(block.index(i, j, k));
      }
  return cells;
}

void print_error(const std::string& coefficient,
                 const std::string& name,
                 const std::vector<std::size_t>& cells,
                 const std::vector<double>& found,
                 const std::vector<double>& truth) {
  double sum = 0.0;
  double squares = 0.0;
  for (const std::size_t c : cells) {
    const double log_ratio = std::log(found[c] / truth[c]);
    sum += log_ratio;
    squares += log_ratio * log_ratio;
  }
  const auto count = static_cast<double>(cells.size());
  print_figure(fmt::format("inverse.{}_bias", coefficient), name, sum / count, "1");
  print_figure(fmt::format("inverse.{}_error", coefficient), name, std::sqrt(squares / count), "1");
}

}  // namespace

void print_material_error(const std::string& name,
                          const Material& material,
                          const Material& truth,
                          Face seen_face) {
  const auto cells = cells_near(truth.block, seen_face);
  for (std::size_t c = 0; c < kColorChannels; ++c) {
    const std::string channel = fmt::format("{}, {}", name, kChannelNames[c]);
    const ChannelCoefficients& found = material.channels[c];
    const ChannelCoefficients& real = truth.channels[c];
    print_error("scattering", channel, cells, found.reduced_scattering, real.reduced_scattering);
    print_error("absorption", channel, cells, found.absorption, real.absorption);
  }
}

}  // namespace opaline::bench
