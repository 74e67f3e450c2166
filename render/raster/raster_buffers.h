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
  Vec4f marks;
};
struct RasterVertex {
  Vec4f place;
  Vec4f normal;
  Vec4f matte;
};
struct RasterGlow {
  std::array<float, 3> fluence;
  std::array<float, 3> flux;
  float mark;
  float unused;
};

inline constexpr int kShadowMaps = 4;
inline constexpr int kMostLights = 96;  ///< what a uniform buffer of 16384 bytes holds

/// What stays while only light and lamps change. Triangles more than 45 degrees off a vertex's normal are flat, as in
/// Surfaces: they have corners of their own.
struct RasterGeometry {
  struct Source {
    int object = 0;
    int vertex = 0;
  };
  std::vector<RasterVertex> vertices;
  std::vector<Source> sources;         ///< of each vertex
  std::vector<std::uint32_t> corners;  ///< of triangles; first those seen from one side only
  std::uint32_t closed_corners = 0;    ///< of translucent objects that are nowhere inside out
  struct Ball {
    Vec3 centre;
    double radius = 0.0;
  };
  Ball all;      ///< holds everything
  Ball casters;  ///< holds what casts shadows: all but planes, where there is anything else
};
RasterGeometry raster_geometry(const std::vector<SceneRenderer::DrawnObject>& objects);

std::vector<RasterObject> raster_objects(const std::vector<SceneRenderer::DrawnObject>& objects);

/// The light on each vertex, as it is now.
std::vector<RasterGlow> raster_glow(const std::vector<SceneRenderer::DrawnObject>& objects,
                                    const RasterGeometry& geometry);

/// The scene's lights, at most kMostLights. A shadow map covers the casters; those with a shadow map come with the view it is drawn with, at most kShadowMaps. A point light has one
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
