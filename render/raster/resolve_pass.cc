#include "render/raster/resolve_pass.h"

#include "render_resolve_shaders.h"

namespace opaline::render {

Result<gpu::Pipeline> make_resolve_pass(gpu::Context& context) {
  return gpu::Pipeline::create_compute(
      context, "resolve", shaders::resolve_comp, {2, sizeof(ResolveShape)});
}

void record_resolve(const gpu::Pipeline& pass,
                    const gpu::Buffer& samples,
                    const gpu::Buffer& pixels,
                    const ResolveShape& shape,
                    gpu::Commands& commands) {
  commands.dispatch(pass,
                    {{{&samples, &pixels}}, gpu::push_of(shape)},
                    {(shape.width * shape.height + 127) / 128, 1, 1});
}

}  // namespace opaline::render
