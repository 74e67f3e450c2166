#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "base/result.h"

namespace opaline::sim {

/// What can go wrong at the simulated station. To add one: an enumerator, its line in the table of
/// faults.cc, and the place in rig.cc that asks for it.
enum class FaultKind : std::uint8_t {
  kStaleFrame,      ///< the exposure shows the pattern before this one, and its id says so
  kDuplicateFrame,  ///< the last frame is delivered again, down to its trigger count
  kTornFrame,       ///< the lower half is the last frame's; the hash is the undamaged one's
  kBlackFrame,      ///< no light reaches the sensor, though the pattern id is right
  kMissingFrame,    ///< no frame comes: kTimeout
  kSkippedTrigger,  ///< the camera took a frame in between that nobody asked for: the count jumps
                    ///< by two
  kTimeBackwards,   ///< the frame's start lies before the last frame's
  kWrongExposure,   ///< the shutter stays open a third longer, and the frame says so
  kCameraLost,     ///< the camera is unplugged in the middle of an exposure, and for the opens that
                   ///< follow
  kProjectorLost,  ///< the projector is unplugged when told to show, and for the opens that follow
  kPatternStuck,   ///< show() is acknowledged, the old pattern stays
  kSlowProjector,  ///< the light follows a second late
  kLampStuck,      ///< dark() is acknowledged, the lamp stays on
  kGammaOn,  ///< the projector applies a gamma of 2.2 to the codes of the pattern it is told to show
  kBlackDrift,       ///< the frame's codes are 24 too high
  kSwappedChannels,  ///< the frame's red and blue are swapped
  kFlicker,          ///< the lamp is 3 % off in this exposure, one way or the other
  kWheelBeat,        ///< the colour wheel turns a tenth faster than it says during this exposure
  kMovedBoard,  ///< a calibration board is knocked against before the projector shows the pattern
  kMovedSample,  ///< what the camera sees is moved by a pixel and a half before this exposure, and stays there
  kShadow,  ///< something is in the way of a tenth of the picture, a bit below its middle, during this exposure, and takes a fifth of its light
  kFadingLamp,  ///< the lamp loses 2 % from this exposure on: so many times, exposure after exposure
  kUnreportedExposure,  ///< an exposure of a second or more lasts a tenth longer than the frame says
};

/// One fault to come: of the events it fits, the first `skip` pass, the next `count` fail.
struct Fault {
  FaultKind kind = FaultKind::kStaleFrame;
  std::uint64_t pattern = 0;  ///< only while this pattern is shown, or is to be; 0 = any
  int skip = 0;               ///< events that pass first
  int count = 1;              ///< events that fail; for a lost device also the opens that do
  bool operator==(const Fault&) const = default;
};

/// What is wrong with the station from the start.
using Faults = std::vector<Fault>;

struct FaultName {
  FaultKind kind;
  std::string_view name;     ///< "stale_frame"
  std::string_view meaning;  ///< one line for people
};
std::span<const FaultName> fault_names();
std::string_view to_string(FaultKind kind);
/// Errors: kInvalidArgument listing the names there are.
Result<FaultKind> fault_from_name(std::string_view name);

/// The faults still to come. Not thread-safe.
class FaultPlan {
 public:
  void arm(Faults faults) { faults_ = std::move(faults); }
  void add(const Faults& faults) { faults_.insert(faults_.end(), faults.begin(), faults.end()); }
  /// Whether a fault of this kind strikes this event; uses it up.
  bool strikes(FaultKind kind, std::uint64_t pattern);
  /// The same, but uses the whole of it up and returns its count; 0 = none strikes.
  int strikes_for_good(FaultKind kind, std::uint64_t pattern);
  const Faults& left() const { return faults_; }

 private:
  Faults::iterator due(FaultKind kind, std::uint64_t pattern);
  Faults faults_;
};

}  // namespace opaline::sim
