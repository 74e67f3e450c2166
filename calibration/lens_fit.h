#pragma once

#include <span>
#include <stop_token>
#include <string>
#include <vector>

#include "base/camera_model.h"
#include "base/result.h"
#include "calibration/board.h"
#include "calibration/bundle_adjustment.h"

namespace opaline::calibration {

/// What makes a view or a corner one that cannot be believed.
struct LensFitOptions {
  double blurred = 1.5;     ///< edges more than so many times as wide as most views', and 0.3 px
  double faint = 0.4;       ///< less than so much of most views' contrast
  double worst_view = 2.5;  ///< reprojection RMS over most views', and 0.05 px
  double disagree =
      1.6;  ///< reprojection RMS of both lenses together over that of each alone, and 0.03 px
  double outlier = 4.5;  ///< a corner so many of its view's standard deviations off; 0: all count
  int fewest_views = 5;
};

/// One view and what became of it.
struct ViewFit {
  std::string name;
  std::string reason;  ///< why it was left out; empty: it was kept
  int corners = 0;     ///< that count
  double rms_px = 0.0;
  double blur_px = 0.0;
  Pose camera_from_board;
  bool kept() const { return reason.empty(); }
};

struct LensFit {
  CameraModel lens;
  LensDeviation
      deviation{};  ///< standard deviations of fx fy cx cy k1 k2 p1 p2 k3; of a term held at 0 the one it had free
  int radial_terms = 3;  ///< of k1 k2 k3: those that the views tell
  double rms_px = 0.0;   ///< of the kept views' corners
  double worst_view_px = 0.0;
  double median_view_px = 0.0;
  double coverage = 0.0;  ///< share of 8 x 6 fields of the picture in which there are corners
  int corners = 0;
  int outliers = 0;  ///< corners of kept views that do not count
  std::vector<ViewFit> views;
  int kept() const;
};

/// Takes over the deviations of the radial terms that are held at 0.
void keep_held(LensDeviation& deviation, int radial_terms, const LensDeviation& free);

/// A lens from views of a board: closed-form start (zhang.h), robust bundle adjustment (Huber at 2 standard deviations), views
/// that are blurred, faint or do not fit left out by name, single corners too, and least squares over the rest. Of the radial terms k3,
/// and then k2, is held at 0 where it is less than two of its standard deviations: a small board in the middle of the picture does
/// not tell it, and in the corners it would be a guess.
/// Errors: kInvalidArgument when fewer than `fewest_views` are left, with what was wrong with the others; kCancelled.
Result<LensFit> fit_lens(int width,
                         int height,
                         const Board& board,
                         std::span<const BoardView> views,
                         const LensFitOptions& options,
                         std::stop_token stop);

}  // namespace opaline::calibration
