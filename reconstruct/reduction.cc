#include "reconstruct/reduction.h"

#include <fmt/format.h>

#include <cmath>

#include "reconstruct/regrid.h"

namespace opaline::reconstruct {

Result<void> validate(const Reduction& r) {
  if (!(r.grid_step >= 1.0 && std::isfinite(r.grid_step)))
    return invalid_argument(fmt::format("grid_step = {}; expected >= 1", r.grid_step));
  if (r.regions < 0)
    return invalid_argument(fmt::format("use_regions = {}; expected >= 0", r.regions));
  return ok();
}

Result<Dataset> reduced(const Dataset& dataset, const Reduction& reduction) {
  if (auto valid = validate(reduction); !valid) return valid.error();
  auto fewer = reduction.regions > 0 ? with_regions(dataset, reduction.regions) : dataset;
  if (!fewer) return fewer.error();
  return on_grid(*fewer, coarser(dataset.block, reduction.grid_step));
}

}  // namespace opaline::reconstruct
