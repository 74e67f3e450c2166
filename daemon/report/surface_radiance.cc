#include "daemon/report/surface_radiance.h"

#include <numbers>

#include "base/material.h"
#include "reconstruct/diffusion/fresnel.h"

namespace opaline::daemon {

Image<float> surface_radiance(const render::SurfaceField& field,
                              Face face,
                              const Image<float>& cosines) {
  namespace diffusion = reconstruct::diffusion;
  const render::FaceField& surface = field.faces[static_cast<std::size_t>(face)];
  const double eta = field.ior;
  Image<float> radiance(cosines.width(), cosines.height(), kColorChannels);
  for (int row = 0; row < radiance.height(); ++row) {
    for (int column = 0; column < radiance.width(); ++column) {
      const double cosine = cosines.at(column, row);
      const double gain = (1.0 - diffusion::fresnel_reflectance(cosine, eta)) /
                          (4.0 * std::numbers::pi * eta * eta);
      const double inside = diffusion::refracted_cosine(cosine, eta);
      for (int c = 0; c < kColorChannels; ++c) {
        radiance.at(column, row, c) =
            static_cast<float>(gain * (surface.fluence.at(column, row, c) +
                                       3.0 * surface.net_flux.at(column, row, c) * inside));
      }
    }
  }
  return radiance;
}

}  // namespace opaline::daemon
