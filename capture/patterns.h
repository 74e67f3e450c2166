#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "base/block.h"
#include "base/image.h"
#include "base/result.h"
#include "capture/calibration.h"
#include "capture/capture_options.h"
#include "capture/face_light.h"
#include "drivers/projector.h"

namespace opaline::capture {

/// Ids of the two patterns every session shows; lights count from kFirstLight.
inline constexpr std::uint64_t kBlackPattern = 1;
inline constexpr std::uint64_t kWhitePattern = 2;
inline constexpr std::uint64_t kFirstLight = 16;

/// One light the sample is measured under.
struct Light {
  std::string name;
  bool held_out = false;
  bool uniform = false;
  drivers::Pattern pattern;
  Image<float> irradiance;  ///< on the lit face, W/mm^2, above what the black pattern sends there
};

/// All that a session shows.
struct PatternSet {
  drivers::Pattern black;  ///< measures what leaks at code 0, and the camera's own black
  drivers::Pattern white;  ///< the whole picture lit: tells a dark region from a dead lamp
  std::vector<Light> lights;
};

/// n x n regions, "region_ROW_COLUMN", then the held-out lights: regions shifted by half a region
/// ("held_out_shifted_K"), twice and half as large ("held_out_large_K", "held_out_small_K"), as
/// many of each in turn as fit the face and differ; at last "uniform", the whole face, if wanted.
///
/// Light falls on whole projector pixels, and its irradiance is what these send (face_light.h). Errors: kInvalidArgument when the
/// projector does not reach the whole face or a light has no pixel.
Result<PatternSet> make_patterns(const PatternOptions& options,
                                 const Block& block,
                                 Face lit_face,
                                 const ProjectorCalibration& projector);

/// What make_patterns() would say against it, without making them.
Result<void> check_patterns(const PatternOptions& options,
                            const Block& block,
                            Face lit_face,
                            const ProjectorCalibration& projector);

/// Irradiance on the lit face's cells while the projector shows `codes`, less that of code 0.
Image<float> irradiance_of(const Image<std::uint8_t>& codes,
                           const Block& block,
                           Face lit_face,
                           const ProjectorCalibration& projector);

}  // namespace opaline::capture
