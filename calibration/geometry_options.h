#pragma once

#include <chrono>
#include <cstdint>

#include "base/result.h"
#include "calibration/board.h"

namespace opaline::calibration {

/// The board that a station's lenses are measured with, and how it is shown.
struct GeometryOptions {
  /// What the projector shows on the board: sinusoids (phase_code.h), or chessboards (projected_boards.h) and coarse sinusoids.
  enum class Projected : std::uint8_t { kSinusoids, kChessboards };
  Board board{.kind = Board::Kind::kNone};
  Projected projected = Projected::kSinusoids;
  int poses = 16;                                                   ///< 6 to 100
  std::chrono::nanoseconds time_to_move = std::chrono::seconds(8);  ///< lamp off before each pose

  bool has_board() const { return board.kind != Board::Kind::kNone; }
};
/// Errors: kInvalidArgument naming the member, its value and what was expected; a known length is needed.
Result<void> validate(const GeometryOptions& options);

}  // namespace opaline::calibration
