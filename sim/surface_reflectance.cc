#include "sim/surface_reflectance.h"

#include <cmath>

#include "sim/noise.h"
#include "sim/options_check.h"

namespace opaline::sim {

Result<void> validate(const SurfaceOptions& options) {
  return OptionsCheck()
      .within("reflectance", options.reflectance, 0.0, 0.3)
      .within("contrast", options.contrast, 0.0, 3.0)
      .above("feature_mm", options.feature_mm, 0.0)
      .result();
}

Image<float> surface_reflectance(const SurfaceOptions& options, const Block& block, Face face) {
  Image<float> reflectance(block.face_width(face), block.face_height(face), 3);
  for (int row = 0; row < reflectance.height(); ++row) {
    for (int column = 0; column < reflectance.width(); ++column) {
      const Vec3 at = block.face_cell_centre(face, column, row) * (1.0 / options.feature_mm);
      const double texture = fractal_noise(at, options.seed, 2);
      for (int c = 0; c < 3; ++c) {
        reflectance.at(column, row, c) =
            static_cast<float>(options.reflectance * std::exp(options.contrast * texture));
      }
    }
  }
  return reflectance;
}

}  // namespace opaline::sim
