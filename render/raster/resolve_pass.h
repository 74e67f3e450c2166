#pragma once

#include <cstdint>

#include "gpu/commands.h"

namespace opaline::render {

/// Pixels as the mean of their samples, samples_per_axis squared each on a regular grid (render/shaders/resolve.comp).
struct ResolveShape {
  std::uint32_t width = 0;  ///< pixels
  std::uint32_t height = 0;
  std::uint32_t samples_per_axis = 1;
};
Result<gpu::Pipeline> make_resolve_pass(gpu::Context& context);

/// Both buffers RGBA floats in rows: `samples` of samples_per_axis times the pixels each way.
void record_resolve(const gpu::Pipeline& pass,
                    const gpu::Buffer& samples,
                    const gpu::Buffer& pixels,
                    const ResolveShape& shape,
                    gpu::Commands& commands);

}  // namespace opaline::render
