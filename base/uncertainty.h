#pragma once

#include <array>
#include <vector>

#include "base/material.h"

namespace opaline {

/// What is said of the natural logarithms of one channel's coefficients, one value a cell in the block's order.
struct LogCoefficients {
  std::vector<double> absorption;          ///< of log sigma_a
  std::vector<double> reduced_scattering;  ///< of log sigma_s'
  std::vector<double> diffusion;           ///< of log kappa
  bool operator==(const LogCoefficients&) const = default;
};

/// How well one channel is known: the posterior's mean lies `shift` from what is reported, and its own
/// deviation is (deviation^2 - shift^2)^(1/2). Of the logarithms: 0.1 is about 10 %, 1 a factor of e.
struct ChannelUncertainty {
  LogCoefficients deviation;  ///< about what is reported
  LogCoefficients shift;
  bool operator==(const ChannelUncertainty&) const = default;
};

/// How well a material is known.
using MaterialUncertainty = std::array<ChannelUncertainty, kColorChannels>;

}  // namespace opaline
