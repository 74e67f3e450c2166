#pragma once

#include <memory>
#include <stop_token>
#include <string>

#include "base/camera_model.h"
#include "base/image.h"
#include "base/result.h"
#include "gpu/context.h"
#include "render/surface_field.h"

namespace opaline::render {

struct RendererOptions {
  gpu::ContextOptions gpu;  ///< which device draws; `graphics` is set by the renderer
  int samples_per_axis =
      2;  ///< of each pixel, on a regular grid: 2 takes 4 samples a pixel; 1 to 8
  int host_threads =
      0;  ///< 0: through Vulkan; else without a device, on so many threads (render/block_rays.h)
};

/// Draws lit translucent blocks headless, through Vulkan or without a device, in linear radiance.
///
/// Every sample is exact: triangles only say where to look, the fragment shader undoes the lens
/// (Brown's distortion, Newton's method), meets the ray with the face's plane and evaluates the
/// camera equation there; a pixel is the mean of its samples.
///
/// Units:   radiance in W/(mm^2 sr), as the field's W/mm^2.
/// Threads: one draw at a time per renderer; separate renderers are independent.
/// Errors:  kInvalidArgument when the field or the camera make no sense or the block is not wholly
/// in front of the
///          camera; kCancelled between tiles; kUnavailable without a device that will do, or when
///          it is lost.
class Renderer {
 public:
  static Result<std::unique_ptr<Renderer>> create(const RendererOptions& options);
  /// Through Vulkan where there is a device that will do, else on `host_threads` threads (0: one a core); description() says which.
  static Result<std::unique_ptr<Renderer>> create_or_host(RendererOptions options,
                                                          int host_threads);
  ~Renderer();

  /// A picture of camera.width x camera.height pixels, 4 channels: red, green, blue, and the part
  /// of the pixel that the block covers. The background is 0; radiance is averaged over the whole
  /// pixel (a sensor's view), so a pixel on the block's edge holds coverage times the block's
  /// radiance.
  Result<Image<float>> draw(const SurfaceField& field,
                            const CameraModel& camera,
                            std::stop_token stop);

  std::string description() const;  ///< "llvmpipe (LLVM 15.0.6, 256 bits), 4 samples a pixel"

 private:
  struct State;
  Renderer(const RendererOptions& options, std::unique_ptr<State> state);
  RendererOptions options_;
  std::unique_ptr<State> state_;  // none: on the host
};

}  // namespace opaline::render
