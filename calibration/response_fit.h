#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "base/image.h"
#include "base/result.h"
#include "capture/calibration.h"

namespace opaline::calibration {

/// The codes between which a sensor tells of light.
struct CodeRange {
  double black = 64.0;       ///< without light
  double clipping = 4095.0;  ///< where pixels are full
  double floor =
      0.0;  ///< so many codes above black noise alone may reach: a response is not asked below
};

/// One picture of a scene that does not move, under light that does not change.
struct Exposure {
  const Image<std::uint16_t>* frame = nullptr;  ///< outlives the fit
  double seconds = 0.0;                         ///< as the camera says
};

/// A response and the exposure times that go with it.
struct ResponseFit {
  capture::ResponseCurve curve;  ///< kTable, strictly increasing
  std::vector<double> seconds;   ///< as measured, in the order given
  double residual = 0.0;         ///< rms over samples used, of the logarithm of light
  int pixels_used = 0;
  int pixels_refused = 0;  ///< stuck, or against all others
};

/// Recovers how one colour channel's codes follow the light, from a stack of exposures (Debevec and Malik 1997, Eq. 3):
/// with f_ij the fraction of the code range of pixel i in exposure j, the least squares of
///
///   sum_ij w(f_ij) [ln f_ij + h(f_ij) - ln E_i - ln t_j - d_j]^2  +  lambda sum_k w(f_k) [h''(f_k) + h'(f_k) / f_k]^2
///
/// over h (piecewise linear, 65 knots, 0 for a linear sensor and straight in ln f for one with a gamma, so that little is
/// interpolated and what is penalised is no power of f), the light E_i of each pixel
/// and the errors d_j of the logarithms of the times. Unknown response and times share one freedom, E -> E^p, t -> t^p: the
/// d_j are what remains after a constant and a multiple of ln t_j, so two exposures are believed. w = f (1 - f) between
/// 1 % (or the floor, below which noise would be mistaken for light) and 98 % of the range. Pixels weigh by Geman and McClure's function of their own residual; one whose codes do
/// not grow with the time is stuck and refused. What noise leaves of falling parts is pooled (isotonic regression).
///
/// Shapes:  2 to 64 frames of one size; 8 to 16 bits.
/// Threads: free function, nothing shared.
/// Errors:  kInvalidArgument for shapes, times, or a channel that is not there; when fewer than 50 pixels, or too small a
///          part of the code range, tell of the response; or when most pixels contradict it.
Result<ResponseFit> fit_response(std::span<const Exposure> stack, CodeRange range, int channel);

/// The signal s at fraction f of the code range, both 0 to 1.
double signal_at(const capture::ResponseCurve& curve, double fraction);

/// The most by which a response departs from the best line through 0, over 5 to 95 % of the range, as a share of full
/// scale. Up to 0.005 a sensor is taken as linear.
double departure_from_line(const capture::ResponseCurve& curve);

}  // namespace opaline::calibration
