#include "drivers/light_stage.h"

#include <fmt/format.h>

namespace opaline::drivers {

Result<void> check(const StagePattern& pattern, const LightStageInfo& info) {
  if (pattern.id == 0) return invalid_argument("pattern id 0; expected > 0");
  if (pattern.codes.size() != info.lights.size())
    return invalid_argument(fmt::format("pattern {}: {} codes; expected one for each of {} lights",
                                        pattern.id,
                                        pattern.codes.size(),
                                        info.lights.size()));
  if (pattern.polarization != Polarization::kCross && !info.turns_polarizer)
    return invalid_argument(
        fmt::format("pattern {}: parallel polarisation; expected crossed, since the stage cannot "
                    "turn its polariser",
                    pattern.id));
  return ok();
}

}  // namespace opaline::drivers
