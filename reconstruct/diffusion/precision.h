#pragma once

#include <cstdint>
#include <string_view>

namespace opaline::reconstruct::diffusion {

/// How a solver holds numbers between the residuals, which are always in float64: what it reaches
/// is the same, what differs is time and memory.
enum class Precision : std::uint8_t {
  kHalf,    ///< the multigrid's corrections in binary16, all else and all arithmetic in float32
  kSingle,  ///< float32
  kDouble,  ///< float64, twice the memory
};
std::string_view to_string(Precision precision);  ///< "half" | "single" | "double"

}  // namespace opaline::reconstruct::diffusion
