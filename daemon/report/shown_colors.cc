#include "daemon/report/shown_colors.h"

#include <algorithm>
#include <cstddef>
#include <utility>

namespace opaline::daemon {

ShownColors::ShownColors(const calibration::ColorCorrection& correction,
                         const std::array<double, 3>& sensitivity,
                         std::string name)
    : correction_(correction), name_(std::move(name)) {
  calibration::CameraRgb white{};
  for (std::size_t c = 0; c < 3; ++c) {
    code_of_[c] = sensitivity[c] / sensitivity[1];
    white[c] = correction.white_balance[1] / correction.white_balance[c];
  }
  const double luminance = correction.xyz(white)[1];
  if (luminance > 0.0) scale_ = 1.0 / luminance;
}

Image<float> ShownColors::apply(const Image<float>& radiance) const {
  Image<float> shown(radiance.width(), radiance.height(), 3);
  for (std::size_t i = 0; i < radiance.pixel_count(); ++i) {
    calibration::CameraRgb codes{};
    for (std::size_t c = 0; c < 3; ++c) codes[c] = code_of_[c] * radiance.samples()[3 * i + c];
    const auto rgb = calibration::linear_srgb(correction_.xyz(codes));
    for (std::size_t c = 0; c < 3; ++c)
      shown.samples()[3 * i + c] = static_cast<float>(std::max(0.0, scale_ * rgb[c]));
  }
  return shown;
}

}  // namespace opaline::daemon
