#pragma once

#include <bit>
#include <cstdint>
#include <vector>

#include "render/solver/lane_matrix.h"

namespace opaline::render {

/// An entry of a LaneMatrix in half as many bits or fewer, for smoothing, which waits for memory and need not be exact: 16 bits
/// of a float (sign, exponent and 7 bits, rounded to nearest), a float of a double. A matrix by its conductances and row sums
/// stays one: symmetric, and positive definite.
template <class T>
struct RoughEntry;

template <>
struct RoughEntry<float> {
  typedef std::uint16_t Bits __attribute__((
      vector_size(8)));  // NOLINT(modernize-use-using): `using` takes no attribute here
  typedef std::uint32_t Wide __attribute__((vector_size(16)));  // NOLINT(modernize-use-using)
  Bits bits;

  static RoughEntry of(const Lanes<float>& value) {
    const Wide rounded = (std::bit_cast<Wide>(value.part[0]) + 0x8000U) >> 16;
    return {__builtin_convertvector(rounded, Bits)};
  }
  Lanes<float> value() const {
    const Wide wide = __builtin_convertvector(bits, Wide) << 16;
    Lanes<float> lanes{};
    lanes.part[0] = std::bit_cast<Lanes<float>::Register>(wide);
    return lanes;
  }
};

template <>
struct RoughEntry<double> {
  Lanes<float>::Register floats;

  static RoughEntry of(const Lanes<double>& value) {
    RoughEntry entry{};
    for (int lane = 0; lane < kLanes; ++lane) entry.floats[lane] = static_cast<float>(value[lane]);
    return entry;
  }
  Lanes<double> value() const {
    Lanes<double> wide{};
    for (int lane = 0; lane < kLanes; ++lane) {
      wide.part[lane / 2][lane % 2] = static_cast<double>(floats[lane]);
    }
    return wide;
  }
};

template <class T>
using RoughEntries = std::vector<RoughEntry<T>>;

}  // namespace opaline::render
