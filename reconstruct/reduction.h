#pragma once

#include "base/dataset.h"
#include "base/result.h"

namespace opaline::reconstruct {

/// With how much of the data a material is looked for: less is sooner, and coarser.
struct Reduction {
  double grid_step = 1.0;  ///< cells of the sample to one of the reconstruction, each axis; >= 1
  int regions = 0;         ///< put together to n x n (reconstruct/regrid.h); 0: as captured
  bool operator==(const Reduction&) const = default;
};
Result<void> validate(const Reduction& reduction);  ///< "grid_step = 0; expected >= 1"

/// What is left of a dataset. Errors: kInvalidArgument.
Result<Dataset> reduced(const Dataset& dataset, const Reduction& reduction);

}  // namespace opaline::reconstruct
