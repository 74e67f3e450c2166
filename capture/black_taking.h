#pragma once

#include <stop_token>
#include <vector>

#include "base/events.h"
#include "base/image.h"
#include "base/result.h"
#include "capture/capture_options.h"
#include "capture/frame_store.h"
#include "capture/patterns.h"
#include "capture/region_taker.h"

namespace opaline::capture {

/// What is to be subtracted from every light.
struct TakenBlack {
  std::vector<CapturedFrame> black;
  std::vector<CapturedFrame>
      white;  ///< of the white picture, that tell them; empty: they speak for themselves
};

/// Takes the black frames of a session. For planned exposures, whose time counts: one of each exposure, and eight of the white picture at
/// the shortest (told_black.h); where these do not tell the black, black frames anew, as many as planned_blacks() says. A fact
/// "capture.black" {frames, exposed_s, told_by_white, message} says which. `seen` marks the pixels (1) that see the sample.
/// Errors: as RegionTaker.
Result<TakenBlack> take_blacks(RegionTaker& taker,
                               const PatternSet& patterns,
                               const RegionTaker::Settings& settings,
                               const Image<std::uint8_t>& seen,
                               EventSink& events,
                               const RegionTaker::Watcher& watcher,
                               std::stop_token stop);

}  // namespace opaline::capture
