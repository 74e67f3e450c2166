#pragma once

#include <optional>

#include "base/image.h"
#include "gpu/commands.h"

namespace opaline::render {

/// A part of a picture, of at most 1024 x 1024 samples (16 MiB, whatever the picture's size): what triangles are drawn into
/// and averaged in. A pixel is the mean of its samples, samples_per_axis squared on a regular grid
/// (render/shaders/resolve.comp).
///
/// Units: linear, RGBA floats in rows, top row first.
struct PictureTile {
  gpu::RenderTarget target;
  gpu::Buffer samples;  ///< width x height x samples_per_axis^2, on the device
  gpu::Buffer pixels;   ///< width x height, on the host
  int width = 0;        ///< pixels
  int height = 0;
  int samples_per_axis = 1;

  /// Averages what was drawn into `pixels`; a barrier is its last command.
  void record_average(const gpu::Pipeline& resolve, gpu::Commands& commands);
  /// Copies what of it lies within the picture, its own corner at (x0, y0).
  void copy_to(int x0, int y0, Image<float>& picture);
};

/// Makes the tile that a picture needs, or leaves the one there is where it will do. Errors: those of RenderTarget and Buffer.
Result<void> prepare_tile(gpu::Context& context,
                          int width,
                          int height,
                          int samples_per_axis,
                          std::optional<PictureTile>& tile);

Result<gpu::Pipeline> make_resolve_pass(gpu::Context& context);

}  // namespace opaline::render
