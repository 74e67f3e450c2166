#pragma once

#include <cstdint>
#include <string>

#include "base/image.h"
#include "base/result.h"
#include "calibration/board.h"

namespace opaline::calibration {

/// Finds the inner corners of a board in a grey picture, to sub-pixels.
///
/// A chessboard is found whole or not at all, by growing it from its corners (OpenCV's findChessboardCornersSB; Duda & Frese
/// 2018), or where that fails by its squares. A ChArUco board is found by its markers, also where part of it is hidden.
/// Corners are then refined where the gradients of the picture around them are perpendicular to the lines from them (OpenCV's
/// cornerSubPix, Foerstner & Guelch 1987), and from there placed by a model of their edges (corner_model.h) where that holds. The blur of its edges is the second moment of their profiles' slopes.
///
/// Shapes: one channel. Threads: any. Errors: kInvalidArgument for a board or picture that makes no sense. Not to find the
/// board is an answer: BoardView::fault says so.
Result<BoardView> find_board(const Image<std::uint8_t>& grey,
                             const Board& board,
                             const std::string& name);

/// A board that can be printed. Errors: kInvalidArgument naming the member, its value and what was expected.
Result<void> validate(const Board& board);

/// A picture of any range as one of 256 greys: the darkest and the brightest 0.1 % of samples become 0 and 255, in between it
/// is linear. Mean of the channels.
Image<std::uint8_t> grey_of(const Image<std::uint16_t>& picture);
Image<std::uint8_t> grey_of(const Image<float>& picture);

}  // namespace opaline::calibration
