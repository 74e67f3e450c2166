#pragma once

#include <cstddef>

namespace opaline::bench {

/// Median milliseconds of frames through the rasteriser.
struct RasterFrame {
  double take_ms = 0.0;  ///< sending the surface with its light, and drawing the shadow map
  double draw_ms = 0.0;  ///< the picture, back on the host
  double whole_ms = 0.0;
  double whole_cpu_ms =
      0.0;  ///< of all threads of the processor, which a busy machine hardly slows
  std::size_t triangles = 0;
};
/// Ends the program where there is no device.
RasterFrame raster_frame();

}  // namespace opaline::bench
