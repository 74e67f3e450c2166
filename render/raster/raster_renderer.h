#pragma once

#include <cstdint>
#include <memory>
#include <stop_token>
#include <string>

#include "base/image.h"
#include "base/result.h"
#include "gpu/context.h"
#include "render/scene/scene_renderer.h"

namespace opaline::render {

struct RasterOptions {
  gpu::ContextOptions gpu;   ///< which device draws; `graphics` is set by the renderer
  int shadow_texels = 1024;  ///< along a shadow map's sides, 16 to 2048
};

/// Draws the surfaces of a lit scene through Vulkan's rasteriser: the twin of Painter, with the same radiance of a point.
/// What differs: lights are looked up in shadow maps (Williams, Casting curved shadows on curved surfaces, 1978; the four
/// texels around a place, bilinear), what hides the mirrored environment is the share of the sky that a place sees, and
/// every pixel takes samples x samples on a regular grid. Lights that stand within the scene, and shadows of lights beyond
/// the fourth, cast none: left_out() says so.
///
/// Units:   radiance in W/(mm^2 sr).
/// Threads: one call at a time.
/// Errors:  kInvalidArgument for a scene too large for one binding of the device, a distorted camera or options out of range;
///          kCancelled between tiles; kUnavailable without a device that will do, or when it is lost: make another then.
class RasterRenderer {
 public:
  static Result<std::unique_ptr<RasterRenderer>> create(const RasterOptions& options);
  ~RasterRenderer();

  /// Takes surfaces, light and lamps of a scene as they are now, and draws the shadow maps.
  Result<void> take(const SceneRenderer& scene);

  /// Linear radiance and coverage, as Painter::draw(). Call take() first.
  Result<Image<float>> draw(const CameraModel& camera, int samples_per_axis, std::stop_token stop);

  /// The same as a screen shows it, 4 channels of sRGB: radiance times gain, over a background; one sample a pixel.
  struct Tone {
    Colour background{};
    double gain = 1.0;
  };
  Result<Image<std::uint8_t>> display(const CameraModel& camera, const Tone& tone);

  const std::vector<std::string>& left_out() const;
  std::string description() const;

 private:
  struct State;
  explicit RasterRenderer(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace opaline::render
