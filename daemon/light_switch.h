#pragma once

#include <functional>
#include <memory>

#include "base/result.h"
#include "config/rig_config.h"
#include "drivers/udmx/udmx_bus.h"

namespace opaline::daemon {

/// What makes a station's light source dark from outside the job that drives it, and has seen it dark when it succeeds. A light that ends with its job's
/// process (a simulated station inside it), or that is a folder of photographs, needs nothing done.
/// `bus` finds uDMX interfaces anew each time.
std::function<Result<void>()> light_switch(
    const config::RigConfig& rig,
    std::function<std::unique_ptr<drivers::UdmxBus>()> bus = drivers::make_usb_bus);

}  // namespace opaline::daemon
