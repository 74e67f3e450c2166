#pragma once

#include <cstdint>
#include <optional>

#include "base/camera_model.h"
#include "base/image.h"

namespace opaline::calibration {

/// Where a corner is thought to be: two edges cross there.
struct CornerGuess {
  CameraModel::Pixel place;   ///< to half a pixel or so
  double first_angle = 0.0;   ///< of one edge, from the x axis towards y, radian
  double second_angle = 0.0;  ///< of the other
  double blur_px = 0.8;       ///< standard deviation
};

struct ModelledCorner {
  CameraModel::Pixel place;
  double blur_px = 0.0;
  double rms = 0.0;  ///< of what the model leaves, over half the step from black to white
  double step =
      0.0;  ///< c: half that step with a sign, > 0 where the sides of both edges with e > 0 meet in white
};

/// The place of a corner of a chessboard to hundredths of a pixel, by least squares of the picture in a disc of `radius` pixels against
///
///   I(p) = a + b (p - p0) + (c + d (p - p0)) e1 e2,    ei = erf(ni (p - corner) / (sqrt(2) sigma))
///
/// two straight edges blurred by a Gaussian, under light that changes linearly, over the corner's place, both angles, sigma, a, b, c
/// and d (Levenberg and Marquardt). Lucchese & Mitra 2002 fit the saddle that this has in its middle; all of the edges in the disc
/// tell more, and a picture of finite pixels is no polynomial. Curves that keep black and white apart (a gamma) make edges
/// wander, but the whole stays the same under a half turn about the corner, and so its place.
///
/// None where the disc leaves the picture, or the model does not hold: it leaves more than 0.3, or moves the corner by more than 1.5 px.
/// Shapes: one channel. Threads: any.
std::optional<ModelledCorner> fit_corner(const Image<std::uint8_t>& grey,
                                         const CornerGuess& guess,
                                         double radius);

}  // namespace opaline::calibration
