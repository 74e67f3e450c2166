#pragma once

#include <cstdint>
#include <string>

#include "base/frame.h"
#include "base/image.h"
#include "calibration/board.h"
#include "calibration/pose_guide.h"

namespace opaline::calibration {

/// What whoever holds the board says.
enum class PoseAnswer : std::uint8_t {
  kNone,
  kTake,    ///< take this pose as it is
  kEnough,  ///< no more poses
};

/// The board in the picture, while it is waited for and once a pose has been taken.
struct PoseSight {
  const Image<std::uint8_t>& grey;
  const BoardView& board;
  const PoseGuide& guide;  ///< of the poses taken so far
  int pose = 0;            ///< from 1
  int poses = 0;
  bool taken = false;
  std::string doing;  ///< "hold it still"
};

/// Whoever attends a calibration: is shown what the camera sees, and holds the board. Called on the calibration's thread; what
/// takes long here holds it up.
class Attendant {
 public:
  virtual ~Attendant() = default;
  /// Whether a person moves the board: then each pose waits until it has been moved and stands still (posing.h). The simulated
  /// station takes the next pose by itself.
  virtual bool holds_the_board() const { return false; }
  /// Asked once for each picture while a pose is waited for; each answer counts once.
  virtual PoseAnswer answer() { return PoseAnswer::kNone; }
  /// Each frame of every step, as it comes.
  virtual void saw(const Frame& /*frame*/) {}
  virtual void saw(const PoseSight& /*sight*/) {}
};

}  // namespace opaline::calibration
