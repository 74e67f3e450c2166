#pragma once

#include <array>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "base/image.h"
#include "base/result.h"
#include "base/session_directory.h"
#include "base/stage_record.h"
#include "config/session_config.h"
#include "daemon/report/hdr_picture.h"
#include "reconstruct/spherical_gradient/stage_correction.h"

namespace opaline::daemon {

/// What a capture in a sphere of lights left in its session's directory.
struct SphereSession {
  StageRecord record;
  std::map<std::string, HdrPicture> pictures;  ///< by name
  Image<std::uint8_t> measured;                ///< reconstruct::kNotSeen, kMeasured, kClipped
};

/// Reads light_stage.json and the pictures it names. The object is what is brighter than `object_threshold` of a white surface under the constant
/// pattern, less `edge_px` along its outline, and less hot pixels.
/// Errors: kNotFound; kInvalidArgument for damaged files or pictures that are missing or of other sizes.
Result<SphereSession> read_sphere_session(const SessionDirectory& session,
                                          const config::LedSphereOptions& options);

/// One channel, each picture as bright as if the lamps had not drifted; the constant one is the mean of the first and the last.
reconstruct::StagePictures channel_pictures(const SphereSession& session, int channel);

/// Parallel less cross-polarised picture under constant light, over a white surface's: the surface's reflection. None without such a picture.
std::optional<Image<float>> specular_map(const SphereSession& session);

/// How many lamps light the object: neither dead nor a beam, which is dark in every pattern.
std::size_t shining_lamps(const StageRecord& record);

/// Radiance of a white surface under the constant pattern, cross-polarised.
double white_radiance(const StageRecord& record);

}  // namespace opaline::daemon
