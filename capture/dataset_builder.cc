#include "capture/dataset_builder.h"

#include <algorithm>

#include "base/direct_light.h"

namespace opaline::capture {

Dataset empty_dataset(const SampleGeometry& sample, const SurfaceMap& map) {
  Dataset dataset;
  dataset.block = sample.block;
  dataset.ior = sample.ior;
  dataset.lit_face = sample.lit_face;
  dataset.seen_face = sample.seen_face;
  dataset.view_cosine = map.view().cosine;
  dataset.view_direction = map.view().direction;
  return dataset;
}

Illumination illumination_of(const Light& light,
                             const SurfaceRadiance& surface,
                             const SampleGeometry& sample,
                             double margin_mm,
                             bool usable) {
  Illumination measured{light.name,
                        light.held_out,
                        light.irradiance,
                        surface.radiance,
                        surface.variance,
                        surface.mask,
                        surface.place_share};
  if (!usable) std::ranges::fill(measured.mask.samples(), std::uint8_t{0});
  if (sample.lit_face == sample.seen_face && !light.uniform) {
    mask_direct_light(sample.block, sample.lit_face, light.irradiance, margin_mm, measured.mask);
  }
  return measured;
}

}  // namespace opaline::capture
