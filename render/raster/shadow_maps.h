#pragma once

#include <optional>
#include <vector>

#include "gpu/commands.h"
#include "render/raster/raster_buffers.h"

namespace opaline::render {

/// What lights see first: depth from 1 near to 0 far, floats in rows (Williams, Casting curved shadows on curved surfaces,
/// 1978). Maps stay as they are while neither surfaces nor their views change.
class ShadowMaps {
 public:
  static Result<ShadowMaps> create(gpu::Context& context, int texels);

  /// Whether these views are other ones than were drawn.
  bool differ(const std::vector<Rows>& views) const { return views != views_; }
  /// Draws `views`: rows of clip coordinates from the scene's. `vertices` are RasterVertex. Errors: those of Buffer.
  Result<void> record(gpu::Context& context,
                      const std::vector<Rows>& views,
                      const gpu::Buffer& vertices,
                      const gpu::Commands::Indexed& triangles,
                      gpu::Commands& commands);
  /// One after another; without any view there is still something to bind.
  const gpu::Buffer& maps() const { return *maps_; }

 private:
  ShadowMaps(gpu::Pipeline pipeline, int texels)
      : pipeline_(std::move(pipeline)), texels_(texels) {}

  gpu::Pipeline pipeline_;
  int texels_;
  std::optional<gpu::RenderTarget> target_;
  std::optional<gpu::Buffer> maps_;
  std::vector<Rows> views_;
};

}  // namespace opaline::render
