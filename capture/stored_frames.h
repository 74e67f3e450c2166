#pragma once

#include <string>
#include <vector>

#include "base/camera_model.h"
#include "base/events.h"
#include "capture/frame_store.h"

namespace opaline::capture {

/// A light's frames on disk, as far as they can be used: none where it was never captured wholly, is of another pattern or camera, or is damaged, which is logged and noted
/// ("region.damaged": region, message). Errors: FrameStore::load's, the events'.
Result<std::vector<CapturedFrame>> usable_frames(const FrameStore& store,
                                                 const std::string& light,
                                                 const drivers::Pattern& pattern,
                                                 const CameraModel& camera,
                                                 EventSink& events);

}  // namespace opaline::capture
