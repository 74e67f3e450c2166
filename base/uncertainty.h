#pragma once

#include <array>
#include <vector>

#include "base/material.h"

namespace opaline {

/// Standard deviations of the natural logarithms of one channel's coefficients, one value a cell in
/// the block's order: 0.1 is about 10 %; 1 is a factor of e up or down.
struct ChannelUncertainty {
  std::vector<double> absorption;          ///< of log sigma_a
  std::vector<double> reduced_scattering;  ///< of log sigma_s'
  std::vector<double> diffusion;           ///< of log kappa
  bool operator==(const ChannelUncertainty&) const = default;
};

/// How well a material is known.
using MaterialUncertainty = std::array<ChannelUncertainty, kColorChannels>;

}  // namespace opaline
