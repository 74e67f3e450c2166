#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "base/camera_model.h"
#include "base/result.h"
#include "render/surface_field.h"

namespace opaline::render {

/// The scene as the shaders read it: render/shaders/scene.glsl, std430.
struct SceneBuffer {
  using Vec4 = std::array<float, 4>;
  using IVec4 = std::array<std::int32_t, 4>;
  std::array<Vec4, 3> camera_from_sample;
  Vec4 centre;
  Vec4 focal;
  Vec4 distortion;
  Vec4 optics;
  Vec4 spacing;
  IVec4 cells;
  IVec4 visible;
  std::array<IVec4, 2> first;
};

/// Triangles of a face are this many squares along each edge: Brown's lens with k1 = -0.3 bends a
/// face that fills the picture by 0.03 of a pixel in a thousand between two vertices; the shader's
/// margin forgives far more.
inline constexpr int kSegments = 64;

/// Errors: kInvalidArgument when the camera makes no sense, stands inside the block, or the block
/// reaches behind it.
Result<SceneBuffer> describe_scene(const SurfaceField& field,
                                   const CameraModel& camera,
                                   int samples_per_axis);

/// phi_s and J_n of every face cell, as pairs of RGBA, faces one after another.
std::vector<float> pack_field(const SurfaceField& field);

}  // namespace opaline::render
