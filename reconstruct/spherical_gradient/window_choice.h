#pragma once

#include <array>
#include <vector>

#include "reconstruct/spherical_gradient/ball_table.h"
#include "reconstruct/spherical_gradient/scattering_maps.h"
#include "reconstruct/spherical_gradient/window_fit.h"

namespace opaline::reconstruct {

/// Ratios of flat surfaces, looked up by reflectance.
class FlatRatios {
 public:
  explicit FlatRatios(const BallTable& table);
  double at(double reflectance) const;

 private:
  static constexpr int kSteps = 256;
  std::array<double, kSteps + 1> ratios_{};
};

/// Deviations below zero that noise reaches nowhere in a picture of so many pixels: its least value is near sqrt(2 ln n) of them, and half a one more makes it a
/// matter of one picture in some thirty. What is concave by that is LeftOut::kConcave.
double sure_deviations(const PixelValues& values);

/// The smallest window of every pixel that is certain enough or surely concave, or the largest one that agrees with those before
/// (MapOptions); normals into `maps` by the first that is certain of them.
std::vector<WindowValues> choose_windows(const PixelValues& values,
                                         const FlatRatios& flat,
                                         const MapOptions& options,
                                         ThreadTeam& team,
                                         ScatteringMaps& maps);

}  // namespace opaline::reconstruct
