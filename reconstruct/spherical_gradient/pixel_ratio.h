#pragma once

#include <cstddef>

#include "reconstruct/spherical_gradient/scattering_maps.h"
#include "reconstruct/spherical_gradient/window_fit.h"

namespace opaline::reconstruct {

/// What one pixel of the pictures says by itself: its normal (Ma et al. 2007) into both, r and the reflectance with their variances into `values`; why it
/// says nothing, else.
void measure_pixel(const GradientPictures& pictures,
                   std::size_t at,
                   PixelValues& values,
                   ScatteringMaps& maps);

}  // namespace opaline::reconstruct
