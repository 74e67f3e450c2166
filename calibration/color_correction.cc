#include "calibration/color_correction.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace opaline::calibration {

std::string_view to_string(ColorModel model) {
  return model == ColorModel::kMatrix ? "matrix" : "root_polynomial";
}

std::vector<double> color_terms(ColorModel model,
                                const CameraRgb& white_balance,
                                const CameraRgb& rgb) {
  std::vector<double> v(3);
  for (std::size_t c = 0; c < 3; ++c) v[c] = std::max(0.0, rgb[c] * white_balance[c]);
  if (model == ColorModel::kRootPolynomial)
    v.insert(v.end(), {std::sqrt(v[0] * v[1]), std::sqrt(v[1] * v[2]), std::sqrt(v[2] * v[0])});
  return v;
}

Xyz ColorCorrection::xyz(const CameraRgb& rgb) const {
  const std::vector<double> terms = color_terms(model, white_balance, rgb);
  Xyz out{};
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t k = 0; k < terms.size(); ++k)
      out[i] += coefficients[i * terms.size() + k] * terms[k];
  }
  return out;
}

std::array<double, 3> linear_srgb(const Xyz& v) {
  return {3.1338561 * v[0] - 1.6168667 * v[1] - 0.4906146 * v[2],
          -0.9787684 * v[0] + 1.9161415 * v[1] + 0.0334540 * v[2],
          0.0719453 * v[0] - 0.2289914 * v[1] + 1.4052427 * v[2]};
}

}  // namespace opaline::calibration
