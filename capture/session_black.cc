#include "capture/session_black.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "base/seconds.h"
#include "capture/black_taking.h"
#include "capture/stored_frames.h"

namespace opaline::capture {

Result<void> SessionBlack::load() {
  const CameraModel& camera = settings_.camera.model;
  auto black = usable_frames(store_, kBlackName, patterns_.black, camera, events_);
  if (!black) return black.error();
  const bool told = store_.has(kWhiteName);
  const auto white = usable_frames(store_, kWhiteName, patterns_.white, camera, events_);
  if (!white) return white.error();
  if (!black->empty() && told != white->empty()) use(*std::move(black), *white);
  return ok();
}

Result<void> SessionBlack::take(RegionTaker& taker,
                                const RegionTaker::Watcher& watcher,
                                std::stop_token stop) {
  auto taken =
      take_blacks(taker, patterns_, settings_, map_.footprint(), events_, watcher, std::move(stop));
  if (!taken) return taken.error();
  if (!taken->white.empty()) {
    if (auto saved = store_.save(kWhiteName, patterns_.white, taken->white); !saved) return saved;
  }
  // Last: with it, both count as taken.
  if (auto saved = store_.save(kBlackName, patterns_.black, taken->black); !saved) return saved;
  use(std::move(taken->black), taken->white);
  return ok();
}

void SessionBlack::use(std::vector<CapturedFrame> black, std::span<const CapturedFrame> white) {
  frames_ = BlackFrames(std::move(black), settings_.camera, map_.footprint(), white);
  merge_.emplace(settings_.camera, frames_.hot());
  cells_.emplace(map_, frames_.footprint(), settings_.options.min_coverage);
}

Result<std::vector<ExposurePair>> SessionBlack::pairs(const std::string& light,
                                                      std::span<const CapturedFrame> frames) const {
  std::vector<ExposurePair> pairs;
  for (const CapturedFrame& frame : frames) {
    const auto pair = frames_.pair(frame);
    if (!pair) {
      return internal_error(
          fmt::format("{}: no black frame of {:.4g} s: delete frames/{} and start again",
                      light,
                      seconds(frame.exposure_asked),
                      kBlackName));
    }
    pairs.push_back(*pair);
  }
  return pairs;
}

bool SessionBlack::show_light(std::span<const ExposurePair> pairs) const {
  return std::ranges::any_of(pairs, [this](const ExposurePair& pair) {
    return measure_light(settings_.camera, pair, frames_.footprint(), 0.0).lit();
  });
}

}  // namespace opaline::capture
