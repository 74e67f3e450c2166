#pragma once

#include <array>
#include <span>
#include <vector>

#include "base/image.h"
#include "base/result.h"
#include "calibration/board.h"
#include "calibration/pair_fit.h"

namespace opaline::calibration {

/// The middle of a white square under the projector's even light.
struct PaperLight {
  Vec3 place;          ///< on the board
  double light = 0.0;  ///< linear, above black, in any unit
};

/// Of each white square of a chessboard whose four corners were seen, the mean over its middle. `even` is linear light, one channel.
/// Empty of a ChArUco board, whose white squares hold markers; squares less than ten pixels across are left out.
std::vector<PaperLight> paper_light(const Image<float>& even,
                                    const BoardView& view,
                                    const Board& board);

/// How lenses darken towards the picture's corners: V(r) = 1 + v0 r^2 + v1 r^4, r as capture::Vignetting has it.
struct VignettingFit {
  std::array<std::array<double, 3>, 2> coefficients{};  ///< of camera and projector; the last is 0
  std::array<double, 2> deviation{};  ///< standard deviation of V, RMS over the picture
  double residual = 0.0;              ///< RMS of the logarithms, what is left
  int squares = 0;                    ///< that count
  double at(std::size_t lens, double r_squared) const;
};

/// Camera's and projector's vignetting from white paper in poses that are known. Paper is matt (Lambert): at distance d from the
/// projector, its light falling at an angle theta,
///
///   log L = s_view + log(cos theta / d^2) + log V_camera(r_camera) + log V_projector(r_projector)
///
/// with a scale of each pose's own, so that the lamp may be dimmed or drift from one to the next. That the two lenses see each place at
/// different r is what tells one from the other. Gauss-Newton; squares that are 4 standard deviations off, once, are left out.
/// `views` are those of `fit`. Errors: kInvalidArgument for fewer than a hundred squares, or when V is not positive.
Result<VignettingFit> fit_vignetting(const PairFit& fit,
                                     std::span<const std::vector<PaperLight>> views);

}  // namespace opaline::calibration
