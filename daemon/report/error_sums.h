#pragma once

#include <array>
#include <cmath>
#include <limits>

#include "base/material.h"

namespace opaline::daemon {

/// Sums behind a relative error of a prediction L against measurements L* of known variance. Every figure of nothing is
/// no number: null in results.json, a dash in the report.
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
  /// ||L - L*|| / ||L*||
  double relative() const { return std::sqrt(squared()); }
  /// What the measurement's noise alone would give.
  double floor() const { return std::sqrt(squared_floor()); }
  /// sum (L - L*)^2 / sum L*^2, the papers' E.
  double squared() const { return over_signal(difference); }
  double squared_floor() const { return over_signal(noise); }

 private:
  double over_signal(double sum) const {
    return signal > 0.0 ? sum / signal : std::numeric_limits<double>::quiet_NaN();
  }
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
