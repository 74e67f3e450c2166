#pragma once

#include "reconstruct/spherical_gradient/ball_table.h"
#include "reconstruct/spherical_gradient/scattering_maps.h"
#include "reconstruct/spherical_gradient/window_choice.h"

namespace opaline::reconstruct {

/// What a window says of the material, whichever of its pixels asks.
struct WindowAnswer {
  LeftOut reason = LeftOut::kNotMeasured;  ///< nothing else is set where it is not kFound
  double reduced_albedo = 0.0;
  double decay = 0.0;         ///< g = sqrt(3 (1 - alpha'))
  double bent = 0.0;          ///< k l_d, with both principal curvatures
  double shift = 0.0;         ///< c of scattering_maps.h: how far a slanted look turns normals
  double log_variance = 0.0;  ///< of ln D, but for what the tilt adds
  double albedo_deviation = 0.0;
};

/// Answers of windows, one after the other: neighbours in a cell of a large window share theirs, others begin their search at the one before.
/// Threads: one at a time per object; what it is made from must outlive it.
class WindowAnswers {
 public:
  /// `sure` deviations make a curvature below zero concave.
  WindowAnswers(const BallTable& table,
                const FlatRatios& flat,
                const MapOptions& options,
                double sure)
      : table_(table), flat_(flat), options_(options), sure_(sure) {}
  const WindowAnswer& of(const WindowValues& window) {
    if (!is_same(window)) answer_ = answer(window);
    return answer_;
  }

 private:
  bool is_same(const WindowValues& w) const;
  WindowAnswer answer(const WindowValues& window);
  LeftOut judge(const WindowValues& window, double ratio_variance) const;
  double ratio_variance(const WindowValues& window) const;
  double reflectance_variance(const WindowValues& window) const;

  const BallTable& table_;
  const FlatRatios& flat_;
  const MapOptions& options_;
  double sure_;
  WindowValues window_;
  WindowAnswer answer_;
  BallTable::Found found_;
  BallTable::Found lower_;  // of MapOptions::lower_index
  BallTable::Found higher_;
};

}  // namespace opaline::reconstruct
