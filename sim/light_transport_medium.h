#pragma once

#include <array>
#include <vector>

#include "base/block.h"
#include "base/material.h"

namespace opaline::sim {

/// One voxel as a tentative collision sees it; 16 bytes, which are read at once.
struct alignas(16) VoxelOptics {
  float accept = 0.0F;  ///< sigma_t / majorant: probability that the collision is real
  float albedo = 0.0F;  ///< sigma_s / sigma_t
  float look = 0.0F;    ///< accept x probability that a real collision is connected to the camera
};
static_assert(sizeof(VoxelOptics) == 16);

/// One channel of a block, prepared for delta tracking.
struct LightTransportMedium {
  Block block;
  double ior = 1.0;
  double anisotropy = 0.0;
  bool periodic_sides = false;
  double majorant = 0.0;            ///< largest sigma_t, 1/mm
  double least_extinction = 0.0;    ///< smallest sigma_t, 1/mm
  std::vector<VoxelOptics> voxels;  ///< in the block's order

  double extinction(std::size_t voxel) const { return voxels[voxel].accept * majorant; }
};

LightTransportMedium make_medium(const Block& block,
                                 double ior,
                                 const ChannelCoefficients& coefficients,
                                 double anisotropy,
                                 bool periodic_sides);

/// Sets `look`: near the seen face always, deeper in proportion to the transmittance straight to
/// the face, so that all connections made carry about the same light. A multiple of 2^-24, as the random numbers are
/// that decide: what is divided by is then the chance there was, however small.
void thin_connections(LightTransportMedium& medium, Face seen);

}  // namespace opaline::sim
