#pragma once

#include <array>
#include <stop_token>
#include <vector>

#include "base/camera_model.h"
#include "base/result.h"

namespace opaline::calibration {

/// A point of the board's plane as one lens saw it.
struct Sighting {
  int lens = 0;
  int view = 0;
  double x_mm = 0.0;
  double y_mm = 0.0;
  CameraModel::Pixel pixel;
};

/// What is adjusted: one lens, or a camera and a projector, that see a flat board in several poses. The pose of lens 0 is the
/// identity; CameraModel::camera_from_sample of the others is lens_from_camera.
struct Bundle {
  std::vector<CameraModel> lenses;
  std::vector<Pose> camera_from_board;  ///< one a view
  std::vector<Sighting> sightings;
  std::vector<int>
      radial_terms;  ///< of each lens's k1 k2 k3 the first so many, 0 to 3; the others stay. Empty: all
};

struct BundleOptions {
  double huber = 0.0;            ///< in sigmas; 0: least squares
  std::vector<double> sigma_px;  ///< of each lens; empty: one
  int most_steps = 200;
  bool want_covariance = true;
};

/// Standard deviations of a lens: fx fy cx cy k1 k2 p1 p2 k3.
using LensDeviation = std::array<double, 9>;

struct BundleSummary {
  std::vector<double> rms_px;  ///< of each lens: sqrt(mean of the squared distances)
  double all_rms_px = 0.0;     ///< of all of them
  std::vector<std::vector<double>> view_rms_px;  ///< [lens][view]; 0 where it saw nothing
  std::vector<double> distance_px;               ///< of each sighting from where it should be
  std::vector<LensDeviation> deviation;          ///< of each lens
  std::array<double, 6>
      pose_deviation{};  ///< of the second lens: rotation (rad) about x, y, z, then mm
  int steps = 0;
};

/// Joint bundle adjustment of lenses and poses (Triggs et al. 2000): minimises
///
///   sum over sightings of rho(|project(lens, lens_from_camera camera_from_board p) - pixel|^2 / sigma^2)
///
/// over fx fy cx cy k1 k2 p1 p2 k3 of each lens (base/camera_model.h has the equation; Bundle::radial_terms), each pose, and the second lens's place,
/// by Levenberg and Marquardt (Ceres, dense Schur complement over the poses). Standard deviations are those of least squares at
/// the solution, from the inverse of J'J times the residuals' own variance.
///
/// Units: px, mm. Threads: one call at a time a bundle. Errors: kInvalidArgument for a sighting of nothing, too few of them,
/// or a problem that is not determined; kCancelled.
Result<BundleSummary> adjust(Bundle& bundle, const BundleOptions& options, std::stop_token stop);

}  // namespace opaline::calibration
