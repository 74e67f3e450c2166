#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "base/block.h"
#include "base/image.h"
#include "base/material.h"

namespace opaline {

/// One illumination of the sample and what the camera saw of it, on the sample's surface cells.
///
/// Shapes: rasters over the cells of a face as Block says, three channels (RGB).
struct Illumination {
  std::string name;         ///< "region_2_1", "held_out_shifted_0"
  bool held_out = false;    ///< kept from the fit, for validation
  Image<float> irradiance;  ///< E on the lit face before Fresnel, W/mm^2; fractional at the edges
                            ///< of a region
  Image<float> radiance;    ///< L towards the camera on the seen face, W/(mm^2 sr)
  Image<float> radiance_variance;  ///< of the measurement, same shape; > 0 where the mask is set
  Image<std::uint8_t>
      mask;  ///< 1 channel: 1 = usable, 0 = saturated, dark, outside, or lit directly
  /// Of radiance_variance, summed: what an inexact calibration adds to the pictures' own noise; 0 to 1.
  double calibration_share = 0.0;
};

/// What was measured, where on the sample, with which variance and mask: all that the
/// reconstruction reads.
struct Dataset {
  Block block;                   ///< the sample's box and the cells its surface is resolved into
  double ior = 1.3;              ///< of the sample, as given
  Face lit_face = Face::kZMin;   ///< light enters here, perpendicular
  Face seen_face = Face::kZMax;  ///< what the camera looks at
  Image<float> view_cosine;  ///< on the seen face, 1 channel: cosine of the angle of the camera to
                             ///< the normal
  Image<float>
      view_direction;  ///< on the seen face, 2 channels: the unit vector towards the camera along the face's
                       ///< column and row axes; empty where only view_cosine is known
  std::vector<Illumination> illuminations;
  std::optional<Illumination>
      uniform;  ///< the whole face lit where it is seen, lit cells not masked: tells what the
                ///< surface reflects (base/surface_reflectance.h); no part of the fit
};

}  // namespace opaline
