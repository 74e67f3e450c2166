#pragma once

#include <array>
#include <string>
#include <vector>

#include "base/block.h"

namespace opaline {

inline constexpr int kColorChannels = 3;  ///< red, green, blue
inline constexpr std::array<const char*, 3> kChannelNames{"red", "green", "blue"};

/// Scattering coefficients of one colour channel, one value a cell in the block's order, 1/mm.
/// The diffusion coefficient is kappa = 1 / (3 (absorption + reduced_scattering)), mm.
struct ChannelCoefficients {
  std::vector<double> absorption;          ///< sigma_a, 1/mm, >= 0
  std::vector<double> reduced_scattering;  ///< sigma_s' = sigma_s (1 - g), 1/mm, > 0
  bool operator==(const ChannelCoefficients&) const = default;
};

/// A volume of scattering coefficients with its geometry: what the reconstruction produces and the
/// renderer draws.
struct Material {
  Block block;
  double ior = 1.3;  ///< relative refractive index
  std::array<ChannelCoefficients, kColorChannels> channels;
  std::string name;
  bool operator==(const Material&) const = default;
};

}  // namespace opaline
