#include "capture/stored_frames.h"

#include <algorithm>
#include <utility>

#include "base/log.h"

namespace opaline::capture {

Result<std::vector<CapturedFrame>> usable_frames(const FrameStore& store,
                                                 const std::string& light,
                                                 const drivers::Pattern& pattern,
                                                 const CameraModel& camera,
                                                 EventSink& events) {
  auto stored = store.load(light, pattern);
  if (!stored) return stored.error();
  if (!stored->damage.empty()) {
    log::warning("{}; {} is taken again", stored->damage, light);
    auto noted = events.fact("region.damaged", {{"region", light}, {"message", stored->damage}});
    if (!noted) return noted.error();
  }
  const bool fits = std::ranges::all_of(stored->frames, [&](const CapturedFrame& c) {
    return c.frame.pixels.width() == camera.width && c.frame.pixels.height() == camera.height &&
           c.frame.pixels.channels() == 3;
  });
  if (!fits) stored->frames.clear();
  return std::move(stored->frames);
}

}  // namespace opaline::capture
