// The geometric part of scripts/bench calibration alone: what is left of the reprojection, and how far lenses and lengths are from the truth.
// Of several runs, each with noise and poses of its own: the median, and the worst.
//
//   geometry [RUNS]

#include <fmt/format.h>

#include <charconv>
#include <cstdio>
#include <span>
#include <string_view>

#include "bench/calibrate/geometry_case.h"

int main(int argc, char** argv) {
  int runs = 1;
  if (argc > 1) {
    const std::string_view text(std::span(argv, static_cast<std::size_t>(argc))[1]);
    const auto read = std::from_chars(text.data(), text.data() + text.size(), runs);
    if (read.ec != std::errc{} || runs < 1) {
      fmt::print(stderr, "geometry: RUNS = {}; expected a number from 1\n", text);
      return 2;
    }
  }
  return opaline::bench::print_geometry(runs) ? 0 : 1;
}
