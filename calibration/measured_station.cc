#include "calibration/measured_station.h"

#include <cstddef>
#include <utility>

#include "calibration/pose_chain.h"

namespace opaline::calibration {
namespace {

// T C T' with T = (R 0; 0 R).
std::array<double, 36> turned(const std::array<double, 36>& covariance,
                              const std::array<double, 9>& r) {
  std::array<double, 36> out{};
  for (std::size_t i = 0; i < 6; ++i) {
    for (std::size_t j = 0; j < 6; ++j) {
      const std::size_t down = 3 * (i / 3);
      const std::size_t across = 3 * (j / 3);
      for (std::size_t k = 0; k < 3; ++k) {
        for (std::size_t l = 0; l < 3; ++l)
          out[6 * i + j] +=
              r[3 * (i % 3) + k] * covariance[6 * (down + k) + across + l] * r[3 * (j % 3) + l];
      }
    }
  }
  return out;
}

}  // namespace

capture::StationCalibration with_measured(capture::StationCalibration given,
                                          const Measured& measured) {
  capture::CameraCalibration& camera = given.camera;
  if (measured.black_level) {
    camera.black_level = *measured.black_level;
    camera.hot_pixels = measured.hot_pixels;
  }
  if (measured.response) camera.response = *measured.response;
  if (measured.gain_electrons_per_code) {
    const double gain = *measured.gain_electrons_per_code;
    for (double& s : camera.sensitivity) s *= gain / camera.gain_electrons_per_code;
    camera.gain_electrons_per_code = gain;
  }
  camera.exposure_factors = measured.exposure_factors;
  if (measured.read_noise_electrons) camera.read_noise_electrons = *measured.read_noise_electrons;
  if (measured.clipping_code) {
    camera.full_well_electrons = 0.0;
    if (*measured.clipping_code < camera.max_code())
      camera.full_well_electrons =
          capture::electrons_from_code(camera, *measured.clipping_code).signal;
  }
  if (measured.camera_lens) {
    const Pose place = camera.model.camera_from_sample;
    camera.model = measured.camera_lens->model;
    camera.model.camera_from_sample = place;
  }
  if (measured.projector_gamma) given.projector.gamma = *measured.projector_gamma;
  if (measured.projector_black) given.projector.black_level = *measured.projector_black;
  if (measured.camera_vignetting) camera.vignetting = *measured.camera_vignetting;
  if (measured.projector_vignetting) given.projector.vignetting = *measured.projector_vignetting;
  const Pose camera_from_sample = camera.model.camera_from_sample;
  return with_place(std::move(given), measured, camera_from_sample, {});
}

capture::StationCalibration with_place(capture::StationCalibration given,
                                       const Measured& measured,
                                       const Pose& camera_from_sample,
                                       const std::array<double, 36>& covariance) {
  given.camera.model.camera_from_sample = camera_from_sample;
  given.camera.place_covariance = covariance;
  capture::ProjectorCalibration& projector = given.projector;
  if (projector.kind == capture::ProjectorKind::kPerspective && measured.projector_lens) {
    const Pose projector_from_camera = measured.projector_lens->model.camera_from_sample;
    projector.lens = measured.projector_lens->model;
    projector.lens.camera_from_sample = chained(projector_from_camera, camera_from_sample);
    projector.place_covariance = turned(covariance, projector_from_camera.rotation);
  }
  return given;
}

}  // namespace opaline::calibration
