#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "base/image.h"
#include "daemon/report/plot.h"
#include "daemon/scattering/beam_measurement.h"
#include "daemon/scattering/sphere_maps.h"

namespace opaline::daemon {

inline constexpr int kReasons = reconstruct::kLastReason + 1;

/// A map as its report shows it.
struct MapView {
  const char* name;
  const char* title;  ///< with its unit
  std::vector<float> reconstruct::ScatteringMaps::*values;
};
extern const std::array<MapView, 4> kMapViews;

/// Normals in colours: red right, green up, blue towards the camera.
Image<std::uint8_t> normal_picture(const Image<float>& normals);
/// Why pixels have no answer, green: white where they have, one colour a reason.
Image<std::uint8_t> reason_picture(const SphereMaps& maps, const Image<std::uint8_t>& measured);
/// A map's three channels in false colours, from its second to its 98th percentile.
MapPlot map_plot(const SphereMaps& maps, double pixel_mm, const MapView& view);
/// The same as a picture, a pixel for a pixel: red, green and blue side by side in Viridis, black where there is no answer.
struct MapPicture {
  Image<std::uint8_t> pixels;
  double lowest = 0.0;   ///< what the darkest colour stands for, and all below
  double highest = 0.0;  ///< the brightest
};
MapPicture map_picture(const SphereMaps& maps, const MapView& view);
/// How often each D was found, by channel.
CurvePlot diffusion_histogram(const SphereMaps& maps);
/// Exitance around a thin beam, and the dipoles fitted to it.
CurvePlot beam_plot(const BeamMeasurement& measurement, double ior);

}  // namespace opaline::daemon
