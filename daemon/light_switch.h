#pragma once

#include <functional>

#include "base/result.h"
#include "config/rig_config.h"

namespace opaline::daemon {

/// What makes a station's light source dark from outside the job that drives it, and has seen it dark when it succeeds. A light that ends with its job's
/// process (a simulated station inside it), or that is a folder of photographs, needs nothing done.
std::function<Result<void>()> light_switch(const config::RigConfig& rig);

}  // namespace opaline::daemon
