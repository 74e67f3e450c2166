#pragma once

#include <array>
#include <cstdint>
#include <string_view>
#include <vector>

#include "calibration/color_difference.h"

namespace opaline::calibration {

/// Linear light of a camera's channels, above black, in any unit that goes with the light.
using CameraRgb = std::array<double, 3>;

/// Which terms of the white-balanced channels a correction is linear in.
enum class ColorModel : std::uint8_t {
  kMatrix,  ///< r g b: 3 x 3
  kRootPolynomial,  ///< r g b sqrt(rg) sqrt(gb) sqrt(br): 3 x 6 (Finlayson, Mackiewicz, Hurlbert 2015, degree 2)
};
std::string_view to_string(ColorModel model);

/// Those terms.
std::vector<double> color_terms(ColorModel model,
                                const CameraRgb& white_balance,
                                const CameraRgb& rgb);

/// Takes a camera's colours to CIE XYZ under D50. Both models are of first degree: twice the light is twice the XYZ, at any
/// exposure.
struct ColorCorrection {
  ColorModel model = ColorModel::kMatrix;
  CameraRgb white_balance{1.0, 1.0, 1.0};  ///< factors that make the lamp's white grey
  std::vector<double> coefficients;        ///< 3 rows, of X, Y and Z
  Xyz xyz(const CameraRgb& rgb) const;
};

/// Linear red, green and blue of ITU-R BT.709, sRGB's, of a colour under D50, adapted to sRGB's white (Bradford); below 0 and
/// above 1 where no display shows it.
std::array<double, 3> linear_srgb(const Xyz& xyz);

}  // namespace opaline::calibration
