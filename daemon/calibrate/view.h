#pragma once

#include <chrono>
#include <filesystem>
#include <functional>
#include <optional>
#include <stop_token>
#include <string>

#include "base/events.h"
#include "base/files.h"
#include "base/result.h"
#include "capture/station.h"
#include "daemon/live_view.h"

namespace opaline::daemon {

/// A viewfinder: pictures of what the camera sees under the projector's white, at most ten a second, until it is stopped, or
/// `frames` of them have been taken (0: no end), or nobody has looked at the live view for as long as `while_watched`. Each is shown
/// live, where there is such a view, and written whole in `directory`, where there is one: view.png, and view.json with focus, the
/// best focus so far, saturation, coverage and histograms; `say` hears one line.
/// The exposure is the longest of whole turns, up to half a second, that fills at most 0.1 % of the samples; after that the light is dimmed.
/// Errors: what the devices return; kCancelled is an end like any other.
struct ViewOptions {
  std::filesystem::path directory;  ///< empty: none
  LiveView* live = nullptr;
  std::optional<std::chrono::seconds> while_watched;
  int frames = 0;
  double black = 64.0;
  double clipping = 4095.0;
};
Result<void> run_viewfinder(const ViewOptions& options,
                            const capture::Station& station,
                            FileOperations& files,
                            EventSink& events,
                            const std::function<void(const std::string&)>& say,
                            const std::stop_token& stop);

}  // namespace opaline::daemon
