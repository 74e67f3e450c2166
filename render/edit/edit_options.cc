#include "render/edit/edit_options.h"

#include <fmt/format.h>

#include <cmath>

namespace opaline::render {

Result<void> validate(const EditOptions& edit) {
  const bool adds = edit.operation == EditOptions::Operation::kAdd;
  const bool scales = edit.operation == EditOptions::Operation::kScale;
  const bool absorbs = edit.quantity == EditOptions::Quantity::kAbsorption;
  const double least = adds ? -1e6 : scales || !absorbs ? 1e-6 : 0.0;
  for (const double value : edit.value) {
    if (!(value >= least && value <= 1e6)) {
      return invalid_argument(fmt::format("value has {}; expected {} to 1e6", value, least));
    }
  }
  if (!(edit.strength >= 0.0 && edit.strength <= 1.0)) {
    return invalid_argument(fmt::format("strength = {}; expected 0 to 1", edit.strength));
  }
  if (!(edit.softness >= 0.0 && edit.softness <= 1.0)) {
    return invalid_argument(fmt::format("softness = {}; expected 0 to 1", edit.softness));
  }
  if (!(edit.radius_mm > 0.0) || !(edit.thickness_mm > 0.0) || !(edit.depth_mm >= 0.0)) {
    return invalid_argument("radius, thickness and depth: expected lengths, the first two above 0");
  }
  if (!(length(edit.direction) > 0.0) || !std::isfinite(length(edit.direction))) {
    return invalid_argument("direction: expected a vector that is not 0");
  }
  return ok();
}

}  // namespace opaline::render
