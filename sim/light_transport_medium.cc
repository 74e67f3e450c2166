#include "sim/light_transport_medium.h"

#include <algorithm>
#include <cmath>

namespace opaline::sim {
namespace {

constexpr double kAlwaysLookAbove =
    0.5;  // transmittance to the face above which every collision is connected

}  // namespace

LightTransportMedium make_medium(const Block& block,
                                 double ior,
                                 const ChannelCoefficients& coefficients,
                                 double anisotropy,
                                 bool periodic_sides) {
  LightTransportMedium medium{block, ior, anisotropy, periodic_sides, 0.0, 0.0, {}};
  const std::size_t count = block.cell_count();
  std::vector<double> extinction(count);
  for (std::size_t i = 0; i < count; ++i) {
    extinction[i] =
        coefficients.absorption[i] + coefficients.reduced_scattering[i] / (1.0 - anisotropy);
  }
  const auto [least, most] = std::minmax_element(extinction.begin(), extinction.end());
  medium.least_extinction = *least;
  medium.majorant = *most;
  medium.voxels.resize(count);
  for (std::size_t i = 0; i < count; ++i) {
    const double albedo = 1.0 - coefficients.absorption[i] / extinction[i];
    medium.voxels[i].accept = static_cast<float>(extinction[i] / medium.majorant);
    medium.voxels[i].albedo = static_cast<float>(albedo);
  }
  return medium;
}

void thin_connections(LightTransportMedium& medium, Face seen) {
  const Block& block = medium.block;
  const int axis = axis_of(seen);
  const int depth = block.cells()[axis];
  const double spacing = block.spacing()[axis];
  const std::size_t stride = axis == 0   ? 1
                             : axis == 1 ? block.nx
                                         : static_cast<std::size_t>(block.nx) * block.ny;
  for (int row = 0; row < block.face_height(seen); ++row) {
    for (int column = 0; column < block.face_width(seen); ++column) {
      std::size_t cell = block.cell_behind(seen, column, row);
      double optical_depth = 0.0;
      for (int i = 0; i < depth; ++i, cell = is_max(seen) ? cell - stride : cell + stride) {
        VoxelOptics& voxel = medium.voxels[cell];
        const double half = 0.5 * spacing * medium.extinction(cell);
        const double look = std::min(1.0, std::exp(-(optical_depth + half)) / kAlwaysLookAbove);
        optical_depth += 2.0 * half;
        voxel.look = static_cast<float>(std::ceil(voxel.accept * look * 0x1p24) * 0x1p-24);
      }
    }
  }
}

}  // namespace opaline::sim
