#pragma once

#include <filesystem>
#include <span>
#include <stop_token>

#include "base/result.h"
#include "daemon/view/view_script.h"
#include "daemon/view/view_window.h"

namespace opaline::daemon {

/// `opaline view SESSION`: a window on the maps of an object in a sphere of lights.
struct MapsViewingOptions {
  std::filesystem::path session;
  std::span<const ViewAction> script;  ///< orbit, light, exposure, wait, resize and screenshot
  int frames =
      0;  ///< ends after so many pictures and the script; 0: when the window is closed, if there is no script
  std::filesystem::path screenshot;  ///< PNG of the last picture
  ViewWindowOptions window;
};

/// On the left what the camera saw, summed for the light that the viewer has turned to (light adds); on the right the same from the maps: the captured view by
/// texture-space diffusion, any other by screen-space diffusion, coarse while it turns. Left button: turns the object; with Shift: the light.
/// Errors: those of MapsScene::open and ViewWindow; kInvalidArgument for what a script cannot do here; kUnavailable when the window's device is lost.
Result<void> view_maps(const MapsViewingOptions& options, std::stop_token stop);

}  // namespace opaline::daemon
