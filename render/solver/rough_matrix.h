#pragma once

#include <bit>
#include <cstdint>
#include <vector>

#include "render/solver/lane_matrix.h"
#include "render/solver/large_pages.h"

namespace opaline::render {

/// An entry of a LaneMatrix in half as many bits or fewer, for smoothing, which waits for memory and need not be exact: 16 bits
/// of a float (sign, exponent and 7 bits, rounded to nearest), a float of a double. Row sums stay as they are, so a matrix of
/// conductances stays one: symmetric, and positive definite.
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

template <class T>
RoughEntries<T> rough_entries(const LaneMatrix<T>& a) {
  RoughEntries<T> rough;
  reserve_large(rough, a.entries.size());
  for (const Lanes<T>& entry : a.entries) rough.push_back(RoughEntry<T>::of(entry));
  return rough;
}

/// One row of A x, about.
template <class T>
inline Lanes<T> apply_rough_row(const LaneMatrix<T>& a,
                                const RoughEntries<T>& rough,
                                const Lanes<T>* x,
                                int row) {
  const Lanes<T> own = x[row];
  Lanes<T> sum = a.sinks[row] * own;
  for (int e = a.starts[row]; e < a.starts[row + 1]; ++e)
    sum += rough[e].value() * (x[a.columns[e]] - own);
  return sum;
}

}  // namespace opaline::render
