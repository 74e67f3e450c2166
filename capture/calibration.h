#pragma once

#include <array>
#include <cstdint>
#include <utility>
#include <vector>

#include "base/camera_model.h"
#include "base/image.h"
#include "base/result.h"

namespace opaline::capture {

/// How a camera's codes follow the light. With f the fraction of the code range above black,
/// s the signal as a fraction of full scale (both 0 to 1):
///
///   kLinear  f = s          kGamma  f = s^(1/gamma)          kTable  s read from a table over f
struct ResponseCurve {
  enum class Kind : std::uint8_t { kLinear, kGamma, kTable };
  Kind kind = Kind::kLinear;
  double gamma = 1.0;         ///< of kGamma; > 0
  std::vector<double> table;  ///< of kTable: s at equally spaced f, strictly increasing from 0 to 1
};

/// Falls off with the distance r from the middle of the picture, in units of half its diagonal:
/// 1 + c0 r^2 + c1 r^4 + c2 r^6.
struct Vignetting {
  std::array<double, 3> coefficients{};
  double at(double r_squared) const;
  double least() const;  ///< of it in the picture, 0 <= r <= 1
};

/// How long an exposure truly is, over what the camera reports, as measured at one exposure.
struct ExposureFactor {
  double reported_s = 0.0;  ///< > 0
  double factor = 1.0;      ///< > 0
};

/// What the capture believes of its camera. A pixel sees
///
///   electrons  = sensitivity . radiance . exposure . vignetting + leaks
///   full_scale = gain (max_code - black_level),   s = electrons / full_scale
///   code       = black_level + (max_code - black_level) . f(s)
///
/// and nothing of what lies above full_scale, or above its full well where that is less.
struct CameraCalibration {
  CameraModel model;
  /// How well its place before the sample is known: covariance of small motions (w, s), rad and mm along the camera's axes, row by
  /// row, p_camera = exp([w]x) R p + t + s; 0: taken for exact.
  std::array<double, 36> place_covariance{};
  int bit_depth = 12;
  ResponseCurve response;
  double black_level = 64.0;                         ///< code without light
  double gain_electrons_per_code = 2.5;              ///< of the linear response
  double full_well_electrons = 0.0;                  ///< where a pixel clips; 0: at full scale
  double read_noise_electrons = 3.0;                 ///< standard deviation
  Vignetting vignetting;                             ///< about the picture's middle
  std::array<double, 3> sensitivity{1e9, 1e9, 1e9};  ///< electrons per (W/(mm^2 sr) s), per channel
  std::vector<ExposureFactor> exposure_factors;      ///< by reported_s, rising; empty: all 1
  /// Known ones, (x, y); others are found in the black frames.
  std::vector<std::pair<int, int>> hot_pixels;

  double max_code() const { return static_cast<double>((1 << bit_depth) - 1); }
  double full_scale_electrons() const {
    return gain_electrons_per_code * (max_code() - black_level);
  }
};

/// How a projector's picture reaches the lit face.
enum class ProjectorKind : std::uint8_t {
  kPerpendicular,  ///< by parallel light, perpendicular on it
  kPerspective,    ///< through its lens, from where it stands
};

/// What the capture believes of its projector. With light = vignetting . (black_level + (1 - black_level) (code/255)^gamma), x and y
/// in its pixels, a point of the lit face receives
///
///   kPerpendicular  peak . light,   (column mm, row mm) = (x - offset_x_px, y - offset_y_px) . mm_per_pixel
///   kPerspective    peak . light . (reference_distance / d)^2 . cos(theta),   (x, y) = lens.project(point)
///
/// with d the distance from the lens's centre, and theta the angle between its ray and the face's normal.
struct ProjectorCalibration {
  ProjectorKind kind = ProjectorKind::kPerpendicular;
  int width = 640;
  int height = 480;
  double mm_per_pixel = 0.05;
  double offset_x_px = 80.0;  ///< the projector pixel at which the lit face's first column begins
  double offset_y_px = 0.0;
  /// Of kPerspective: an inverse camera, camera_from_sample is projector_from_sample; as large as the picture.
  CameraModel lens;
  double reference_distance_mm = 300.0;  ///< at which kPerspective's peak holds
  /// How well the lens's place before the sample is known, as CameraCalibration::place_covariance, along the projector's axes.
  std::array<double, 36> place_covariance{};
  double gamma = 2.2;
  double black_level = 0.001;  ///< light at code 0, as a fraction of the peak
  Vignetting vignetting;       ///< about the middle of the projector's picture
  /// At code 255 in the middle, W/mm^2, per channel.
  std::array<double, 3> peak_irradiance{1e-3, 1e-3, 1e-3};

  /// Vignetting of a pixel.
  double vignetting_at(int x, int y) const;
  /// Fraction of the peak that a code adds to what code 0 leaks.
  double light_of(int code) const;
};

/// Everything measured beforehand about a station; read from the rig file.
struct StationCalibration {
  CameraCalibration camera;
  ProjectorCalibration projector;
};

Result<void> validate(const StationCalibration& calibration);

/// The signal in electrons behind a code, and how far apart two neighbouring codes are there.
struct Electrons {
  double signal = 0.0;
  double per_code = 1.0;
};
Electrons electrons_from_code(const CameraCalibration& camera, double code);

/// The code at which pixels clip: the highest, or that of a full well below full scale.
double clipping_code(const CameraCalibration& camera);

/// The seconds of an exposure that the camera reports as `reported`: times its factor, which between measured exposures goes
/// with the logarithm of the time, and beyond them stays.
double exposed_seconds(const CameraCalibration& camera, double reported);

/// Vignetting of each camera pixel, 1 channel.
Image<float> camera_vignetting(const CameraCalibration& camera);

}  // namespace opaline::capture
