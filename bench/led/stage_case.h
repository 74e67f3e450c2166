#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/stage_record.h"
#include "base/thread_team.h"
#include "reconstruct/spherical_gradient/scattering_maps.h"
#include "reconstruct/spherical_gradient/stage_correction.h"
#include "sim/led_blob.h"

namespace opaline::bench {

/// Monte Carlo balls in a simulated sphere of lights on 600 mm, seen from 1 m by an ordinary camera: full well 30000 electrons, read noise 3, exposed so that
/// the brightest pixel fills 90 % of it, `frames` times a pattern. All three channels are of one material. Deterministic in its seeds.
struct StageScene {
  int lamps = 156;
  std::vector<double> radii_mm{10.0, 6.0};
  std::string body;  ///< in place of the balls, of the only radius (sim/blob.h)
  std::int64_t paths_per_pixel = 512;
  sim::BlobMixture mixture = sim::BlobMixture::kNone;  ///< with a second material
  double second_reduced_albedo = 0.93;
  double second_translucency_mm = 1.0;
  double reduced_albedo = 0.96;
  double translucency_mm = 1.4;
  double ior = 1.4;
  std::int64_t paths = 300'000;  ///< a ball and channel
  double pixel_mm = 0.15;
  std::vector<int> dead_lamps;
  bool dead_are_known = false;  ///< as they are after capture/lamp_check.h
  double intensity_error = 0.0;
  std::uint64_t seed = 1;  ///< of paths and lamps
};

/// How it is photographed and estimated.
struct StageShot {
  int frames = 4;
  bool split = false;  ///< halves of gradients instead of shifted ones
  double clip = 0.0;   ///< gradient_x saturates above this share of its brightest pixel; 0: nowhere
  double ior = 1.4;    ///< believed
  double ior_deviation = 0.0;
  double lamp_deviation = 0.01;  ///< believed, of each lamp
  double white_deviation =
      0.005;                 ///< believed, of the white target that reflectance is measured by
  double white_error = 0.0;  ///< relative, of that target
  int largest_window = 32;
  std::uint64_t noise_seed = 1;
};

/// Over the pixels of one channel.
struct StageErrors {
  double bias = 0.0;        ///< median of ln D over the truth
  double error = 0.0;       ///< root mean square of the same
  double stated = 0.0;      ///< median of the stated deviation
  double coverage = 0.0;    ///< share of the answers within two stated deviations
  double found = 0.0;       ///< share of the pixels that have an answer
  double wrong = 0.0;       ///< share of the pixels that have one beyond two stated deviations
  double normal_deg = 0.0;  ///< mean, over what was measured
  double answered_normal_deg = 0.0;  ///< mean, over the pixels that have an answer
  double albedo_error = 0.0;         ///< mean of |alpha' - truth| over the truth
  double error_90 = 0.0;  ///< |D over the truth - 1| that nine tenths of the answers keep to
  double scattering_error_90 = 0.0;                            ///< the same of sigma_s'
  double seconds = 0.0;                                        ///< of computing
  std::array<double, reconstruct::kLastReason + 1> reasons{};  ///< share of the pixels by LeftOut
};

/// The lamp nearest to a direction.
int lamp_towards(int lamps, Vec3 direction);

/// A traced scene, which may be photographed again and again.
class StageCase {
 public:
  explicit StageCase(const StageScene& scene);

  reconstruct::StagePictures photograph(const StageShot& shot) const;
  reconstruct::ScatteringMaps estimate(const reconstruct::StagePictures& pictures,
                                       const StageShot& shot,
                                       ThreadTeam& team) const;
  StageErrors errors(const reconstruct::StagePictures& pictures,
                     const reconstruct::ScatteringMaps& maps) const;
  StageErrors run(const StageShot& shot, ThreadTeam& team) const;
  const StageRecord& record() const { return record_; }
  double diffusion() const;  ///< the truth of the first material, mm
  const sim::LedTruth& truth() const { return *truth_; }
  const sim::CameraOptics& camera() const { return camera_; }
  /// Simulated seconds of a capture by the camera of sim/optics.h: exposures, and 0.25 s for each pattern to settle.
  double capture_seconds(const StageShot& shot) const;

 private:
  std::vector<float> light(const std::vector<std::uint8_t>& codes) const;

  StageScene scene_;
  StageRecord record_;
  sim::CameraOptics camera_;
  std::unique_ptr<const sim::LightPath> sphere_;
  std::optional<sim::LedTruth> truth_;
  double path_noise_ = 0.0;  // of light traced from pixels; the stated variances have it
};

}  // namespace opaline::bench
