#pragma once

#include <stop_token>

#include "base/camera_model.h"
#include "base/image.h"
#include "base/result.h"
#include "render/surface_field.h"

namespace opaline::render {

/// The picture of Renderer::draw() where there is no Vulkan device: one ray a sample, met with the block's planes (Kay & Kajiya,
/// Ray tracing complex scenes, 1986), and the same camera equation, in double precision on `threads` threads.
///
/// Errors: those of Renderer::draw().
Result<Image<float>> draw_by_rays(const SurfaceField& field,
                                  const CameraModel& camera,
                                  int samples_per_axis,
                                  int threads,
                                  std::stop_token stop);

}  // namespace opaline::render
