#pragma once

#include <array>
#include <string_view>
#include <vector>

#include "base/block.h"
#include "base/camera_model.h"
#include "base/result.h"

namespace opaline::capture {

/// What a cell of a face has of a pixel of the lens that looks at it: a camera's, or a projector's as an inverse camera.
struct PixelShare {
  int x;
  int y;
  float area;  ///< of the pixel, in pixels
};

/// A cell, projected into the picture, is a quadrilateral.
struct CellPixels {
  std::vector<PixelShare> shares;  ///< of pixels in the picture; exact clipping
  double area = 0.0;               ///< of the whole quadrilateral, in pixels
};
CellPixels pixels_of_cell(
    const CameraModel& lens, const Block& block, Face face, int column, int row);

/// Of the point that a lens sees, or lights, where a cell's middle should be: variances along columns and rows, and their
/// covariance, in cells.
struct PointVariance {
  double column = 0.0;
  double row = 0.0;
  double both = 0.0;
};
/// A small motion of what the lens sees, p_lens = exp([w]x) R p + t + s, moves the point p under its ray of direction d, on the face of
/// normal n, by
///
///   u = -(m - d (n m) / (n d)),    m = [w]x R p + s in the sample's frame
///
/// `place_covariance` is that of (w, s), row by row.
PointVariance slip_of_cell(const CameraModel& lens,
                           const Block& block,
                           Face face,
                           int column,
                           int row,
                           const std::array<double, 36>& place_covariance);

/// Errors: kInvalidArgument when a lens, called `name`, is behind the face or turned away from it.
Result<void> check_in_front(const Block& block,
                            Face face,
                            const CameraModel& lens,
                            std::string_view name);

}  // namespace opaline::capture
