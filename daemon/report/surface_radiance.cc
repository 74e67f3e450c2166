#include "daemon/report/surface_radiance.h"

#include <numbers>

#include "base/material.h"
#include "reconstruct/diffusion/fresnel.h"

namespace opaline::daemon {

Image<float> view_cosines(const Block& block, Face face, Vec3 camera_centre) {
  Image<float> cosines(block.face_width(face), block.face_height(face), 1);
  for (int row = 0; row < cosines.height(); ++row) {
    for (int column = 0; column < cosines.width(); ++column) {
      const Vec3 d = normalized(camera_centre - block.face_cell_centre(face, column, row));
      const double along = axis_of(face) == 0 ? d.x : axis_of(face) == 1 ? d.y : d.z;
      cosines.at(column, row) = static_cast<float>(is_max(face) ? along : -along);
    }
  }
  return cosines;
}

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
