#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "base/block.h"
#include "base/image.h"

namespace opaline {

/// What one entry patch on the lit face sends towards the camera, for unit irradiance E = 1 W/mm^2
/// on that patch alone (incident, perpendicular or diffuse; the Fresnel loss at entry is inside).
/// Light that never scattered is left out.
/// Shapes: the seen face's cells, 3 channels; means over each cell. Neighbouring cells share photons, so sums over cells
/// vary more than their variances add up to.
struct PatchResponse {
  Image<float> radiance;  ///< L, W/(mm^2 sr)
  Image<float> variance;  ///< of that estimate, by the Monte Carlo itself; >= 0
  bool operator==(const PatchResponse&) const = default;
};

/// Light transport through one sample as a linear map: radiance on the seen face for each patch of
/// the lit face. Any illumination made of patches is a weighted sum: radiances add with the
/// weights, variances with their squares.
///
/// Shapes: patches are patches_x x patches_y equal rectangles of the lit face's raster (see Block),
/// column fastest.
///         A pattern need not fall on patch edges: weight a patch by the share of it that is lit.
/// Units:  mm, in the sample's frame.
struct TransportResponses {
  Block block;
  double ior = 1.3;
  Face lit_face = Face::kZMin;
  Face seen_face = Face::kZMax;
  bool diffuse_entry = false;  ///< Lambertian light on the lit face instead of perpendicular
  int patches_x = 0;
  int patches_y = 0;
  Vec3 camera_centre;       ///< the radiance is measured towards this point
  double anisotropy = 0.0;  ///< g of the Henyey-Greenstein phase function that was simulated
  std::uint64_t seed = 0;
  int passes = 1;                       ///< runs with seeds seed, seed + 1, ..., averaged
  std::uint64_t photons_per_patch = 0;  ///< in each channel, all passes together
  std::string generator;                ///< program and version of the algorithm
  std::string scene;  ///< what the sample is, one line of JSON: enough to make its material again
  std::vector<PatchResponse> patches;

  const PatchResponse& patch(int column, int row) const {
    return patches[static_cast<std::size_t>(row) * patches_x + column];
  }
  bool operator==(const TransportResponses&) const = default;
};

}  // namespace opaline
