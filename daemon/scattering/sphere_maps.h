#pragma once

#include <array>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <stop_token>

#include "base/events.h"
#include "base/files.h"
#include "base/image.h"
#include "base/result.h"
#include "base/session_directory.h"
#include "config/session_config.h"
#include "daemon/scattering/sphere_session.h"
#include "reconstruct/spherical_gradient/scattering_maps.h"

namespace opaline::daemon {

/// The maps of a session, red, green, blue, and what the surface reflects.
struct SphereMaps {
  std::array<reconstruct::ScatteringMaps, 3> channels;
  std::optional<Image<float>> specular;
};

/// Corrects the pictures for the stage and estimates every pixel. Errors: kInvalidArgument, kCancelled.
Result<SphereMaps> find_maps(const SphereSession& session,
                             const config::LedSphereOptions& options,
                             int threads,
                             EventSink& events,
                             std::stop_token stop);

/// maps.exr: float channels, the picture's pixels, one each of red, green and blue (".R", ".G", ".B") of
///
///   reduced_albedo, reduced_albedo_sd    1           left_out   why a pixel has no answer (LeftOut; 0: it has one, the others are 0)
///   diffusion                            mm          diffusion_log_sd  standard deviation of its logarithm
///   translucency                         mm          reduced_scattering, absorption   1/mm
///   normal_x, normal_y, normal_z         along a row, down a column, towards the camera
///   curvature                            1/mm        specular   of a white surface's light; where it was photographed
///
/// with the units in its metadata. The reduced_... of left-out pixels are 0.
Result<void> write_maps(FileOperations& files,
                        const SessionDirectory& session,
                        const SphereMaps& maps);
Result<SphereMaps> read_maps(const SessionDirectory& session);
Result<SphereMaps> read_maps_file(const std::filesystem::path& path);

/// For reconstruction.json: medians of each channel, how many pixels were left out for which reason, what was assumed.
nlohmann::ordered_json maps_summary(const SphereMaps& maps,
                                    const SphereSession& session,
                                    const config::LedSphereOptions& options);

/// The median of a map over the pixels that have an answer; NaN when none has.
double median_of(const reconstruct::ScatteringMaps& maps, const std::vector<float>& values);

/// The normals' mean over the channels, unit vectors; 0 where none is known. 3 channels.
Image<float> mean_normals(const SphereMaps& maps);

}  // namespace opaline::daemon
