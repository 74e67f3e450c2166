#pragma once

#include <cstdint>
#include <span>

#include "base/image.h"
#include "calibration/board.h"
#include "calibration/phase_code.h"

namespace opaline::calibration {

/// Chessboards that the projector shows on the printed board. Pictures k = 0, 1, ... have squares of s = s_0 + k / 2 projector pixels (rounded down),
/// s_0 a fortieth of the longer side, and begin at o = 0 for even k and s / 2 for odd ones; square (i, j) is lit where i + j is even, and its upper left
/// corner lies at (o + i s, o + j s). A picture moved by (a, b) s with a + b even looks the same, so that one alone does not tell which corner is
/// which; but squares of 16, 17 and 18 pixels are all mapped onto themselves by no move within 640 x 480.
struct ProjectedBoards {
  int width = 640;  ///< of the projector's picture
  int height = 480;
  std::uint8_t white = 255;  ///< the code of the lit squares
  int pictures = 16;

  int square_px(int picture) const;
  int offset_px(int picture) const;
};

/// The coarse code that says which corner is which: only the longest period of `plan`.
PhasePlan coarse_plan(PhasePlan plan);

/// The grey codes of one of `boards.pictures` pictures, one channel.
Image<std::uint8_t> projected_board(const ProjectedBoards& boards, int picture);

/// The corners of a camera's view where the projector would see them, by projected chessboards. `coarse` tells roughly where the camera sees
/// each projected corner. Where the print is even and white about that place, the picture over the even light, q = I / (2 mean), is the projected
/// board alone, and the corner's place q is found in is that of its edges (corner_model.h), with the colours that this corner has. All pairs of
/// camera pixel x and projector pixel p together tell how one maps the board's plane onto the other,
///
///   p = H x + C(x)
///
/// with a homography H and a polynomial C of the fifth degree for both lenses' distortions (of the third, what it leaves of them is more than the
/// noise), by least squares without pairs more than three deviations off; and that map takes the printed corners along that lie among the pairs. Their
/// errors are therefore smooth over a view, and not independent.
///
/// The view has a fault when in any picture less than half of the corners that the print leaves room for are found, as they are where `coarse` says
/// wrongly which is which; when there are fewer than 40 pairs; or when these scatter by more than half a projector pixel.
///
/// Shapes: `pictures` linear, one channel, of the size of `coarse`, one of each of `boards.pictures`. Threads: any.
BoardView projector_view(const ProjectorMap& coarse,
                         const ProjectedBoards& boards,
                         std::span<const Image<float>> pictures,
                         const BoardView& camera_view);

}  // namespace opaline::calibration
