#include "sim/rig_options.h"

#include "sim/options_check.h"

namespace opaline::sim {

Result<void> validate(const RigOptions& options) {
  if (auto good = OptionsCheck().within("time_factor", options.time_factor, 1.0, 1000.0).result();
      !good) {
    return good;
  }
  if (auto good = validate(options.camera); !good) return good.error().in("camera");
  if (auto good = validate(options.projector); !good) return good.error().in("projector");
  if (auto good = validate(options.surface); !good) return good.error().in("surface");
  return ok();
}

}  // namespace opaline::sim
