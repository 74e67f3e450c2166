#include "sim/faults.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <string>

namespace opaline::sim {
namespace {

constexpr std::array kNames{
    FaultName{FaultKind::kStaleFrame, "stale_frame", "the exposure shows the pattern before"},
    FaultName{FaultKind::kDuplicateFrame, "duplicate_frame", "the last frame is delivered again"},
    FaultName{FaultKind::kTornFrame, "torn_frame", "the lower half is the last frame's"},
    FaultName{FaultKind::kBlackFrame, "black_frame", "no light reaches the sensor"},
    FaultName{FaultKind::kMissingFrame, "missing_frame", "no frame comes"},
    FaultName{FaultKind::kSkippedTrigger, "skipped_trigger", "the trigger count jumps by two"},
    FaultName{FaultKind::kTimeBackwards, "time_backwards", "the frame starts before the last one"},
    FaultName{FaultKind::kWrongExposure, "wrong_exposure", "the exposure is a third too long"},
    FaultName{FaultKind::kCameraLost, "camera_lost", "the camera is unplugged during an exposure"},
    FaultName{FaultKind::kProjectorLost, "projector_lost", "the projector is unplugged"},
    FaultName{FaultKind::kPatternStuck, "pattern_stuck", "the projector keeps the old pattern"},
    FaultName{FaultKind::kSlowProjector, "slow_projector", "the light follows a second late"},
    FaultName{FaultKind::kLampStuck, "lamp_stuck", "the lamp stays on when told to go dark"},
    FaultName{FaultKind::kGammaOn, "gamma_on", "the projector applies a gamma of 2.2 to the codes"},
    FaultName{FaultKind::kBlackDrift, "black_drift", "all codes are 24 too high"},
    FaultName{FaultKind::kSwappedChannels, "swapped_channels", "red and blue are swapped"},
    FaultName{FaultKind::kFlicker, "flicker", "the lamp is 3 % off in this exposure"},
    FaultName{
        FaultKind::kWheelBeat, "wheel_beat", "the colour wheel turns a tenth faster than said"},
    FaultName{FaultKind::kMovedBoard, "moved_board", "the calibration board is knocked against"},
    FaultName{FaultKind::kMovedSample, "moved_sample", "the sample moves by 1.5 pixels, for good"},
    FaultName{FaultKind::kShadow, "shadow", "something dims a part of the picture by a fifth"},
    FaultName{FaultKind::kFadingLamp, "fading_lamp", "the lamp loses 2 %, for good"},
    FaultName{FaultKind::kUnreportedExposure,
              "unreported_exposure",
              "1 s and more last a tenth longer, unsaid"},
};

}  // namespace

std::span<const FaultName> fault_names() { return kNames; }

std::string_view to_string(FaultKind kind) { return kNames[static_cast<std::size_t>(kind)].name; }

Result<FaultKind> fault_from_name(std::string_view name) {
  std::string known;
  for (const FaultName& fault : kNames) {
    if (fault.name == name) return fault.kind;
    known += fmt::format("{}{}", known.empty() ? "" : ", ", fault.name);
  }
  return invalid_argument(fmt::format("no fault \"{}\"; there are {}", name, known));
}

bool FaultPlan::strikes(FaultKind kind, std::uint64_t pattern) {
  const auto fault = due(kind, pattern);
  if (fault == faults_.end()) return false;
  if (--fault->count <= 0) faults_.erase(fault);
  return true;
}

int FaultPlan::strikes_for_good(FaultKind kind, std::uint64_t pattern) {
  const auto fault = due(kind, pattern);
  if (fault == faults_.end()) return 0;
  const int count = fault->count;
  faults_.erase(fault);
  return count;
}

Faults::iterator FaultPlan::due(FaultKind kind, std::uint64_t pattern) {
  const auto fault = std::find_if(faults_.begin(), faults_.end(), [&](const Fault& f) {
    return f.kind == kind && (f.pattern == 0 || f.pattern == pattern);
  });
  if (fault == faults_.end() || fault->skip == 0) return fault;
  --fault->skip;
  return faults_.end();
}

}  // namespace opaline::sim
