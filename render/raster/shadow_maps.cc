#include "render/raster/shadow_maps.h"

#include <algorithm>

#include "render_raster_shaders.h"

namespace opaline::render {

Result<ShadowMaps> ShadowMaps::create(gpu::Context& context, int texels) {
  auto pipeline =
      gpu::Pipeline::create_depth(context, "shadow", shaders::shadow_vert, {1, sizeof(Rows)});
  if (!pipeline) return pipeline.error();
  ShadowMaps made(*std::move(pipeline), texels);
  const auto side = static_cast<std::uint32_t>(texels);
  auto target = gpu::RenderTarget::create_depth(context, side, side);
  if (!target) return target.error();
  made.target_ = *std::move(target);
  auto first = gpu::Buffer::create(context, made.target_->depth_bytes(), gpu::Memory::kDevice);
  if (!first) return first.error();
  made.maps_ = *std::move(first);
  return made;
}

Result<void> ShadowMaps::record(gpu::Context& context,
                                const std::vector<Rows>& views,
                                const gpu::Buffer& vertices,
                                const gpu::Commands::Indexed& triangles,
                                gpu::Commands& commands) {
  const std::uint64_t bytes = views.size() * target_->depth_bytes();
  if (maps_->bytes() < bytes) {
    auto made = gpu::Buffer::create(context, bytes, gpu::Memory::kDevice);
    if (!made) return made.error();
    maps_ = *std::move(made);
  }
  for (std::size_t m = 0; m < views.size(); ++m) {
    commands.draw(pipeline_,
                  {{{&vertices}}, gpu::push_of(views[m])},
                  triangles,
                  *target_,
                  /*clear=*/true);
    commands.copy_depth(*target_, *maps_, m * target_->depth_bytes());
  }
  views_ = views;
  return ok();
}

}  // namespace opaline::render
