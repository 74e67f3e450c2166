#pragma once

#include <array>
#include <string>

#include "base/image.h"
#include "calibration/color_correction.h"

namespace opaline::daemon {

/// How a session's pictures are shown: its radiance, which is in the camera's own channels, as linear sRGB by the colour correction of the
/// session's calibration. That one was told by the camera's codes, so each channel's radiance is taken back to those first, times its
/// sensitivity. White keeps its green: what the lamp's white makes grey has the same value in all three channels, the radiance in the green.
class ShownColors {
 public:
  ShownColors(const calibration::ColorCorrection& correction,
              const std::array<double, 3>& sensitivity,
              std::string name);
  /// Of the same shape, 3 channels; what no display shows is cut off at 0.
  Image<float> apply(const Image<float>& radiance) const;
  /// "3 x 3 matrix of calibration 2 of 2026-01-31"
  const std::string& name() const { return name_; }

 private:
  calibration::ColorCorrection correction_;
  std::array<double, 3> code_of_{};  // per radiance, over green's
  double scale_ = 1.0;
  std::string name_;
};

}  // namespace opaline::daemon
