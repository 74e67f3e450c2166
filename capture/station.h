#pragma once

#include "base/clock.h"
#include "drivers/camera.h"
#include "drivers/projector.h"

namespace opaline::capture {

/// The devices of a station, and the clock they are waited for on. All outlive us.
struct Station {
  drivers::Camera& camera;
  drivers::Projector& projector;
  Clock& clock;
};

}  // namespace opaline::capture
