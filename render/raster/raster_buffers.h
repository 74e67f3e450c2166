#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "base/camera_model.h"
#include "render/mesh/triangle_mesh.h"
#include "render/scene/scene_renderer.h"

/// A scene as the shaders of the raster pass read it: render/shaders/raster.glsl, std430.
namespace opaline::render {

using Vec4f = std::array<float, 4>;
using Rows = std::array<Vec4f, 4>;  ///< of a matrix

struct RasterLight {
  Vec4f along;
  Vec4f position;
  Vec4f strength;
  Vec4f cone;
  Rows map;
};
struct RasterObject {
  Vec4f optics;
  Vec4f reflectance;
};
struct RasterVertex {
  Vec4f place;
  Vec4f normal;
  Vec4f fluence;
  Vec4f flux;
};

inline constexpr int kShadowMaps = 4;

struct RasterGeometry {
  std::vector<RasterVertex> vertices;
  std::vector<std::array<std::int32_t, 4>> triangles;  ///< corners and object
  std::vector<RasterObject> objects;
  struct Ball {
    Vec3 centre;
    double radius = 0.0;
  };
  Ball all;      ///< holds everything
  Ball casters;  ///< holds what casts shadows: all but planes, where there is anything else
};
RasterGeometry raster_geometry(const std::vector<SceneRenderer::DrawnObject>& objects);

/// The scene's lights. A shadow map covers the casters; those with a shadow map come with the view it is drawn with, at most kShadowMaps. A point light has one
/// where the whole scene fits into its view, a spot where its cone does; `left_out` says which have none.
struct RasterLights {
  std::vector<RasterLight> lights;
  std::vector<Rows> maps;
  std::vector<std::string> left_out;
};
RasterLights raster_lights(const std::vector<LightOptions>& lights,
                           const RasterGeometry& geometry,
                           int texels);

/// Clip coordinates from the scene's, for a tile of a picture; depth runs from 1 at `near_mm` to 0 far away.
Rows clip_from_scene(
    const CameraModel& camera, int x0, int y0, int width, int height, double near_mm);

}  // namespace opaline::render
