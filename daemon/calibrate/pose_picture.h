#pragma once

#include <cstdint>
#include <vector>

#include "base/image.h"
#include "calibration/board.h"
#include "calibration/pose_guide.h"

namespace opaline::daemon {

/// A pose as an operator looks at it: the corners that were found in green, the first one ringed; fields of the picture (pose_guide.h) in
/// which no pose has had a corner yet are red at their edges. A picture wider than `widest` is halved, or more.
Image<std::uint8_t> pose_picture(const Image<std::uint8_t>& grey,
                                 const calibration::BoardView& board,
                                 const calibration::PoseGuide& guide,
                                 int widest);

/// Means of squares of n x n pixels, the least n with which it is at most `widest` wide; any channels.
Image<std::uint8_t> shrunk(const Image<std::uint8_t>& picture, int widest);

/// Pictures of one size beside and below each other, `columns` in a row, 4 pixels apart on white; RGB.
Image<std::uint8_t> contact_sheet(const std::vector<Image<std::uint8_t>>& pictures, int columns);

}  // namespace opaline::daemon
