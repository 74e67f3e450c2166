#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <stop_token>
#include <string_view>

#include "base/block.h"
#include "base/events.h"
#include "base/image.h"
#include "base/material.h"
#include "base/result.h"
#include "base/transport_responses.h"

namespace opaline::sim {

/// Light of unit irradiance on a rectangle of one face. Positions on a face are (column axis, row
/// axis) as in Block, mm.
struct LightEntry {
  Face face = Face::kZMin;
  bool diffuse = false;     ///< Lambertian instead of perpendicular
  double column_begin = 0;  ///< mm
  double column_end = 0;
  double row_begin = 0;
  double row_end = 0;
};

/// The whole face.
LightEntry whole_face(const Block& block, Face face, bool diffuse = false);
/// Patch (column, row) of patches_x x patches_y equal rectangles.
LightEntry patch_of_face(
    const Block& block, Face face, int patches_x, int patches_y, int column, int row);

/// Radiance is tallied on the cells of `face` towards `centre`, which lies outside, in front of
/// that face.
struct RadianceTally {
  Face face = Face::kZMax;
  Vec3 centre;
};

struct TransportOptions {
  std::uint64_t photons = 1'000'000;  ///< rounded up to whole batches of kBatchPhotons, at least 8
  std::uint64_t seed = 1;
  std::uint64_t stream = 0;  ///< independent random numbers for each value (patch, channel)
  double anisotropy = 0.0;   ///< Henyey-Greenstein g, -0.95 to 0.95; sigma_s = sigma_s' / (1 - g)
  bool count_unscattered = false;  ///< whether light that never scattered counts as exitance
  bool periodic_sides = false;     ///< the block repeats without end along x and y: a slab
  bool tally_exitance = true;
  std::optional<RadianceTally> radiance = {};
  int threads = 0;  ///< 0: as many as there are processors; the result does not depend on it
};

inline constexpr std::uint64_t kBatchPhotons = 4096;
/// The number of photons that are traced when so many are asked for.
std::uint64_t whole_batches(std::uint64_t photons);

/// A tally with the variance of its mean, estimated from the scatter between batches.
struct TallyImage {
  Image<double> mean;
  Image<double> variance;
};
struct TallyValue {
  double mean = 0.0;
  double variance = 0.0;
};

/// What became of the light. Powers are in W for E = 1 W/mm^2 on the entry rectangle; their sum is
/// the incident power.
struct TransportTally {
  std::uint64_t photons = 0;
  double incident = 0.0;  ///< area of the rectangle
  TallyValue specular;    ///< reflected at entry
  TallyValue absorbed;
  TallyValue unscattered;  ///< left without ever scattering and was not counted as exitance
  std::array<TallyValue, 6> escaped;   ///< through each face after scattering
  std::array<TallyImage, 6> exitance;  ///< M per face cell, W/mm^2; empty unless tally_exitance
  TallyImage radiance;  ///< L per cell of the seen face, W/(mm^2 sr); empty unless asked for
};

/// Volumetric Monte Carlo of one colour channel.
///
/// Photons fly free paths through the voxels by delta tracking (Woodcock et al. 1965): tentative
/// collisions at the largest extinction in the block, each accepted with probability sigma_t(x) /
/// sigma_t,max. Scattering is Henyey-Greenstein; absorption is a weight, ended by Russian roulette
/// (unbiased). All six faces reflect by Fresnel's equations, total internal reflection included.
/// `reduced_scattering` of the material is turned into sigma_s = sigma_s' / (1 - g).
///
/// Radiance is by local estimation: every accepted collision adds what it would send straight to
/// the camera,
///
///   w p(cos) Ft e^(-tau) dOmega_i / dA_camera r^2 / (A_cell cos_o)
///
/// through the point of the seen face where the refracted ray passes (docs/physics.md;
/// sim/camera_connection.h has the equations), and through one mirror reflection at each other face
/// on the way. Far collisions are thinned by an unbiased roulette. Light that never scattered is
/// not part of it.
///
/// Threads: the work is cut into parts that do not depend on the number of threads, each with random numbers of its own,
///          and summed in their order: results are equal to the bit for any number of threads.
/// Errors:  kInvalidArgument (sizes, ranges, an almost clear block), kCancelled soon after a stop request.
Result<TransportTally> trace(const Block& block,
                             double ior,
                             const ChannelCoefficients& coefficients,
                             const LightEntry& entry,
                             const TransportOptions& options,
                             std::stop_token stop);

/// How the responses of all patches are computed.
struct ResponseOptions {
  Face lit_face = Face::kZMin;
  Face seen_face = Face::kZMax;
  bool diffuse_entry = false;
  int patches_x = 8;
  int patches_y = 8;
  Vec3 camera_centre;  ///< mm, in the sample's frame, in front of the seen face
  double anisotropy = 0.0;
  std::uint64_t seed = 1;
  std::uint64_t photons_per_patch = 1
                                    << 20;  ///< in each channel; rounded up as in TransportOptions
  int threads = 0;
  bool operator==(const ResponseOptions&) const = default;
};

Result<void> validate(const ResponseOptions& options, const Material& material);

/// The point `distance_mm` from the centre of face z_max, `degrees` off its normal towards +x.
Vec3 camera_above(const Block& block, double distance_mm, double degrees);

/// One patch in all channels.
Result<PatchResponse> patch_response(const Material& material,
                                     const ResponseOptions& options,
                                     int column,
                                     int row,
                                     std::stop_token stop);

/// What writes responses: program and version of the estimate. A later program may give other numbers for the same
/// seed (transport_key() knows); under the same name they agree within the noise.
std::string_view transport_generator();

/// Every patch, reporting progress as step "light transport". `scene` is only written down.
Result<TransportResponses> compute_responses(const Material& material,
                                             const ResponseOptions& options,
                                             std::string scene,
                                             EventSink& events,
                                             std::stop_token stop);

/// The average of two runs, as one with more passes: `next` continues `first` with the seed after its last, all else is
/// the same. What was computed overnight is so made better the night after.
Result<TransportResponses> combine(const TransportResponses& first, const TransportResponses& next);

}  // namespace opaline::sim
