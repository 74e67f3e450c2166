#pragma once

#include <array>
#include <cmath>

#include "base/material.h"

namespace opaline::daemon {

/// Sums behind a relative error of a prediction L against measurements L* of known variance.
struct ErrorSums {
  double difference = 0.0;  ///< sum of (L - L*)^2
  double signal = 0.0;      ///< sum of L*^2
  double noise = 0.0;       ///< sum of the variance of L*

  void add(double predicted, double measured, double variance) {
    difference += (predicted - measured) * (predicted - measured);
    signal += measured * measured;
    noise += variance;
  }
  void add(const ErrorSums& other) {
    difference += other.difference;
    signal += other.signal;
    noise += other.noise;
  }
  /// ||L - L*|| / ||L*||; 0 of nothing.
  double relative() const { return signal > 0.0 ? std::sqrt(difference / signal) : 0.0; }
  /// What the measurement's noise alone would give.
  double floor() const { return signal > 0.0 ? std::sqrt(noise / signal) : 0.0; }
  /// sum (L - L*)^2 / sum L*^2, the papers' E.
  double squared() const { return signal > 0.0 ? difference / signal : 0.0; }
  double squared_floor() const { return signal > 0.0 ? noise / signal : 0.0; }
};

/// The same per colour channel.
struct ChannelErrors {
  std::array<ErrorSums, kColorChannels> channels;

  void add(const ChannelErrors& other) {
    for (int c = 0; c < kColorChannels; ++c) channels[c].add(other.channels[c]);
  }
  ErrorSums all() const {
    ErrorSums sum;
    for (const ErrorSums& channel : channels) sum.add(channel);
    return sum;
  }
};

}  // namespace opaline::daemon
