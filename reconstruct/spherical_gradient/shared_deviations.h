#pragma once

namespace opaline::reconstruct {

/// Relative standard deviations that that an object's pixels share, or nearly: each sees the lamps that its normal faces.
struct SharedDeviations {
  double ratio = 0.0;        ///< of r
  double reflectance = 0.0;  ///< of constant light
  double curvature = 0.0;    ///< of H
};

/// What lamps do whose intensities are believed and each wrong by itself, `of_one` relative. A surface that gives back light by the cosine mu of its direction, n the
/// normal, is lit by the M = lamps/2 with mu > 0, and shows C = sum mu and the gradients' vector A n, A = sum w w^T, w the lamps' directions. To first order in the errors e
///
///   dC / C = sum mu e / sum mu
///   dr / r = dC / C - sum mu^2 e / sum mu^2
///   dH / H = sum (1 - mu^2) e / sum (1 - mu^2) - sum mu^2 e / sum mu^2     (on a ball, H half the divergence of A n / |A n|)
///
/// and for lamps all around, where sum mu^k = M / (k + 1), the variances are 4/3, 2/15 and 9/5 of of_one^2 / M. Light that comes in beyond the horizon, as it does where
/// the object is translucent, is not counted. The white target, by which reflectance is measured, is wrong by itself.
SharedDeviations shared_deviations(double of_one, double lamps, double of_white);

}  // namespace opaline::reconstruct
