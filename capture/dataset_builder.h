#pragma once

#include "base/dataset.h"
#include "capture/capture_options.h"
#include "capture/patterns.h"
#include "capture/surface_map.h"

namespace opaline::capture {

/// A dataset without illuminations yet.
Dataset empty_dataset(const SampleGeometry& sample, const SurfaceMap& map);

/// One light's measurement for the dataset. Where the camera looks at the lit face itself, cells
/// within `margin_mm` of directly lit ones are masked, but in the uniform light, which is there to
/// show them. `usable` false masks everything.
Illumination illumination_of(const Light& light,
                             const SurfaceRadiance& surface,
                             const SampleGeometry& sample,
                             double margin_mm,
                             bool usable);

}  // namespace opaline::capture
