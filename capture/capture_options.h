#pragma once

#include <chrono>
#include <cstdint>

#include "base/block.h"
#include "base/result.h"

namespace opaline::capture {

/// How the exposures of a light are chosen.
enum class ExposureMode : std::uint8_t {
  kBracket,  ///< from the middle: shorter while pixels saturate, longer while dark ones are noisy
  kPlanned,  ///< by the camera's noise model, for the least time (ExposurePlanner)
  kFixed,    ///< all of them
};

/// Which exposures a light is taken with: whole turns of the projector's colour wheel.
struct ExposureOptions {
  ExposureMode mode = ExposureMode::kBracket;
  std::chrono::nanoseconds shortest{33'333'333};    ///< > 0
  std::chrono::nanoseconds longest{8'000'000'000};  ///< >= shortest
  double ratio = 4.0;           ///< each exposure over the one before; > 1, at most 16
  double wanted_snr = 50.0;     ///< bracket: of a dark pixel on the sample; > 0
  double dark_quantile = 0.05;  ///< which pixel counts as dark; 0 to 0.5
  double planned_snr = 100.0;   ///< of a surface cell, in each channel; > 0
  double planned_share = 0.95;  ///< of the surface cells that must have it; 0 < s <= 1
  /// Of a light's brightest cells (99.5 % quantile): what is darker than that needs only its noise, not its SNR; 0 to 1. No time buys SNR where
  /// next to no light comes through.
  double dim_share = 0.01;
};

/// Which lights the sample is measured under.
struct PatternOptions {
  int regions = 4;             ///< n: the lit face in n x n regions; 1 to 32
  int held_out_lights = 8;     ///< shifted by half a region, larger, smaller: never fitted; 0 to 8
  bool uniform_light = false;  ///< the whole face at once, too: for the reflectance of its surface
  int uniform_light_code =
      96;  ///< its code, 1 to 255: a lit cell shines far brighter than those beside one
};

/// How a session is captured.
struct CaptureOptions {
  PatternOptions patterns;
  ExposureOptions exposures;
  int retries = 3;            ///< of a light with a bad frame, before the session stops; 0 to 100
  int settle_periods = 2;     ///< projector frames to wait on top of its latency; 0 to 1000
  double min_coverage = 0.5;  ///< of a surface cell by usable camera pixels; 0 < c <= 1
  /// Masked around a lit region on the face the camera looks at, for the lens's blur and stray light;
  /// 0 to 1000. What the diffusion model cannot say there is left out by the reconstruction.
  double direct_light_margin_mm = 0.5;
  double usable_share = 0.5;  ///< of the regions: fewer usable ones end the session; 0 to 1
};

/// The sample, as the session describes it.
struct SampleGeometry {
  Block block{48, 48, 12, 0.5, 0.5, 0.5};
  double ior = 1.3;
  Face lit_face = Face::kZMin;
  Face seen_face = Face::kZMax;
};

/// "capture.exposures.ratio = 0.8; expected > 1 and at most 16"
Result<void> validate(const CaptureOptions& options);

}  // namespace opaline::capture
