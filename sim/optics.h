#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <span>
#include <vector>

#include "base/block.h"
#include "base/camera_model.h"
#include "base/image.h"
#include "base/result.h"

namespace opaline::sim {

using Rgb = std::array<double, 3>;

/// The demo's camera: 256 x 256 pixels, 300 mm from the middle of the face z_max of a 24 x 24 x 6
/// mm block, 10 degrees off its normal in the x-z plane, mildly distorted.
CameraModel demo_camera_model();

/// What the simulated camera does to the light. From radiance L (W/(mm^2 sr), mean over the pixel,
/// after the PSF), with r the distance from the middle of the picture in units of half its
/// diagonal,
///
///   mean electrons = sensitivity L t (1 + v0 r^2 + v1 r^4 + v2 r^6) + dark t      (t: the measured exposure)
///   electrons      = min(Poisson(mean), full_well) + Normal(0, read_noise)
///   x              = electrons / (gain (max_code - black_level)),  max_code = 2^bit_depth - 1
///   code           = round(black_level + (max_code - black_level) sign(x) |x|^(1/response_gamma)), 0 to max_code
///
/// Noise is drawn from a key of seed, pattern and exposure: the same request gives the same pixels,
/// whenever and however often it is made.
struct CameraOptics {
  CameraModel model = demo_camera_model();
  double psf_sigma_px = 0.6;                           ///< Gaussian; 0 = none
  std::array<double, 3> vignetting{-0.15, 0.02, 0.0};  ///< v0 v1 v2, about the picture's middle
  Rgb sensitivity{1e9, 1e9, 1e9};                      ///< electrons per (W/(mm^2 sr) s)
  double full_well_electrons = 12000.0;
  double gain_electrons_per_code = 2.5;
  double read_noise_electrons = 3.0;  ///< standard deviation
  double dark_electrons_per_second = 1.0;
  double hot_pixel_fraction = 2e-4;  ///< of all pixels, the same ones for a seed
  double hot_pixel_electrons_per_second = 2000.0;
  double response_gamma = 1.0;  ///< 1 = linear
  double black_level = 64.0;    ///< code without light
  int bit_depth = 12;
  double exposure_error =
      1e-4;  ///< relative standard deviation of the true exposure, which is reported
  std::chrono::nanoseconds shortest_exposure = std::chrono::microseconds(100);
  std::chrono::nanoseconds longest_exposure = std::chrono::seconds(10);

  double max_code() const { return static_cast<double>((1 << bit_depth) - 1); }
};
Result<void> validate(const CameraOptics& options);

/// The demo's projector beside its camera: 300 mm from the middle of the face z_max of a 24 x 24 x 6 mm block, 8 degrees off its normal,
/// with pixels of 0.09 mm there.
CameraModel demo_projector_lens();

/// How the simulated projector's light reaches the lit face.
enum class ProjectorKind : std::uint8_t { kPerpendicular, kPerspective };

/// What the simulated projector does with a picture. With light = (1 + v0 r^2 + v1 r^4 + v2 r^6) (black_level + (1 - black_level)
/// (code/255)^gamma), a perpendicular one sends parallel light,
///
///   irradiance = peak light
///
/// at (column mm, row mm) = (x - offset_x_px, y - offset_y_px) mm_per_pixel of the lit face's raster (see Block); one in perspective shines
/// through its lens, an inverse camera, from where that stands,
///
///   irradiance = peak light (reference_distance / d)^2 cos(theta)
///
/// at a distance d from it and an angle theta to the normal. A colour wheel lights one channel after the other, each for a third of a turn at
/// three times the power: only exposures of whole turns see every channel alike.
struct ProjectorOptics {
  ProjectorKind kind = ProjectorKind::kPerpendicular;
  int width = 640;
  int height = 480;
  double mm_per_pixel = 0.05;
  double offset_x_px = 80.0;
  double offset_y_px = 0.0;
  CameraModel lens = demo_projector_lens();  ///< of kPerspective; as large as the picture
  double reference_distance_mm = 300.0;      ///< at which its peak holds
  double gamma = 2.2;
  double black_level = 0.001;  ///< light at code 0, as a fraction of the peak
  std::array<double, 3> vignetting{
      -0.08, 0.0, 0.0};  ///< about the projector picture's middle, r as for the camera
  Rgb peak_irradiance{1e-3, 1e-3, 1e-3};  ///< at code 255 in the middle, W/mm^2, mean over a turn
  std::chrono::nanoseconds latency = std::chrono::milliseconds(50);  ///< from show() to light
  std::chrono::nanoseconds wheel_turn = std::chrono::nanoseconds(33'333'333);  ///< 1/30 s
  bool color_wheel = true;      ///< false: all channels shine all the time, as a light stage's do
  double drift_per_hour = 0.0;  ///< relative, of the light, on the rig's clock
};
Result<void> validate(const ProjectorOptics& options);

/// black_level + (1 - black_level) (code/255)^gamma of each code.
std::array<float, 256> light_of_codes(const ProjectorOptics& options);

/// 1 + v0 r^2 + v1 r^4 + v2 r^6 at each pixel of a picture, 1 channel.
Image<float> vignetting_map(int width, int height, const std::array<double, 3>& coefficients);

/// How long, weighted by power, the wheel lights each channel between two times since a turn began;
/// both seconds. Over whole turns it is the time itself.
Rgb wheel_lit_seconds(double turn_seconds, double from_seconds, double to_seconds);

}  // namespace opaline::sim
