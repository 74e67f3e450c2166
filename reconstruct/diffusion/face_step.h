#pragma once

#include <cstddef>

#include "base/block.h"

namespace opaline::reconstruct::diffusion {

/// From a cell to the next one away from a face, in indices.
inline std::ptrdiff_t inwards(const Block& block, Face face) {
  const std::ptrdiff_t strides[] = {1, block.nx, static_cast<std::ptrdiff_t>(block.nx) * block.ny};
  return is_max(face) ? -strides[axis_of(face)] : strides[axis_of(face)];
}

}  // namespace opaline::reconstruct::diffusion
