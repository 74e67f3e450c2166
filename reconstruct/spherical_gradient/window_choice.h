#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "reconstruct/spherical_gradient/ball_table.h"
#include "reconstruct/spherical_gradient/scattering_maps.h"
#include "reconstruct/spherical_gradient/window_rows.h"

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
/// (MapOptions); normals into `maps` by the first that is certain of them. Band after band of rows, so that what all windows of a band need stays near.
/// Threads: one at a time per object; what it is made from must outlive it.
class WindowChooser {
 public:
  /// A multiple of it begins a band.
  static int rows_of_band(const MapOptions& options);

  /// From a row on, a multiple of rows_of_band().
  WindowChooser(const PixelValues& values,
                const FlatRatios& flat,
                const MapOptions& options,
                double sure,
                int begin,
                ScatteringMaps& maps);
  /// The next band's windows, row by row, of the pixels from its first one on.
  std::span<const WindowValues> next();

 private:
  enum : std::uint8_t { kSettled = 1, kHasNormal = 2, kBoth = 3 };
  void look(WindowRows& rows, int end);
  void choose(const WindowValues& window, std::size_t at);

  const PixelValues& values_;
  const FlatRatios& flat_;
  const MapOptions& options_;
  ScatteringMaps& maps_;
  double sure_;
  int row_;                // of pixels, the next band's first
  std::size_t first_ = 0;  // pixel of the band
  std::vector<WindowRows> windows_;
  std::vector<WindowValues> chosen_;
  std::vector<std::uint8_t> state_;
};

}  // namespace opaline::reconstruct
