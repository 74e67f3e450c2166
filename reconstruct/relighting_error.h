#pragma once

#include <vector>

#include "base/dataset.h"
#include "reconstruct/inverse_result.h"

namespace opaline::reconstruct {

/// ||L - L*|| / ||L*|| over the usable cells and all channels; the noise floor is sqrt(sum variance) / ||L*||.
RelightingError relighting_error(const Illumination& measured, const Image<float>& predicted);

/// The same over all illuminations with `held_out` as asked; `predicted` holds one picture per illumination.
RelightingError relighting_error(const Dataset& dataset,
                                 const std::vector<Image<float>>& predicted,
                                 bool held_out);

}  // namespace opaline::reconstruct
