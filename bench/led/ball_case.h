#pragma once

#include "reconstruct/spherical_gradient/scattering_maps.h"
#include "sim/ball_pictures.h"

namespace opaline::bench {

inline reconstruct::GradientPictures pictures_of(const sim::BallScene& scene,
                                                 const sim::BallPictures& drawn) {
  return {drawn.width,
          drawn.height,
          scene.pixel_mm,
          scene.white,
          drawn.radiance,
          drawn.variance,
          drawn.measured};
}

}  // namespace opaline::bench
