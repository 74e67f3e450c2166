#pragma once

#include <optional>
#include <span>
#include <stop_token>
#include <string>
#include <utility>
#include <vector>

#include "base/events.h"
#include "base/result.h"
#include "capture/black_frames.h"
#include "capture/exposure_planner.h"
#include "capture/frame_store.h"
#include "capture/hdr_merge.h"
#include "capture/patterns.h"
#include "capture/region_taker.h"
#include "capture/surface_map.h"

namespace opaline::capture {

/// Names of what a session stores of it; with the first, all of it is there.
inline constexpr const char* kBlackName = "black";
inline constexpr const char* kWhiteName = "white";

/// A session's black, from its directory or taken, and what rests on it: pairs of frames to subtract, the merge of a light, the cells
/// that exposures are planned for.
class SessionBlack {
 public:
  /// All outlive us.
  SessionBlack(RegionTaker::Settings settings,
               const PatternSet& patterns,
               const SurfaceMap& map,
               FrameStore& store,
               EventSink& events)
      : settings_(std::move(settings)),
        patterns_(patterns),
        map_(map),
        store_(store),
        events_(events) {}

  /// From the directory; frames() stays empty where it is to be taken. White frames that were there and are damaged leave the black untold: both
  /// are to be taken again. Errors: as FrameStore.
  Result<void> load();
  /// Takes and stores it. Errors: as take_blacks() and FrameStore.
  Result<void> take(RegionTaker& taker, const RegionTaker::Watcher& watcher, std::stop_token stop);

  const BlackFrames& frames() const { return frames_; }
  /// These ask for frames().
  const PlannedCells& cells() const { return *cells_; }
  HdrImage merge(std::span<const ExposurePair> bracket) const { return merge_->merge(bracket); }
  /// Errors: kInternal for a frame of an exposure without black, naming the light.
  Result<std::vector<ExposurePair>> pairs(const std::string& light,
                                          std::span<const CapturedFrame> frames) const;
  bool show_light(std::span<const ExposurePair> pairs) const;

 private:
  void use(std::vector<CapturedFrame> black, std::span<const CapturedFrame> white);

  RegionTaker::Settings settings_;
  const PatternSet& patterns_;
  const SurfaceMap& map_;
  FrameStore& store_;
  EventSink& events_;
  BlackFrames frames_;
  std::optional<PlannedCells> cells_;
  std::optional<HdrMerge> merge_;
};

}  // namespace opaline::capture
