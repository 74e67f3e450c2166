#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "base/pose.h"
#include "base/result.h"
#include "reconstruct/diffusion/boundary.h"
#include "render/deform/deform_options.h"
#include "render/edit/edit_options.h"
#include "render/graph/graph_weights.h"

/// A scene as plain values: what a file describes and SceneRenderer draws. Lengths in mm; colours are red, green, blue.
namespace opaline::render {

using Colour = std::array<double, 3>;

/// A shape and where it stands: p = position + R_z R_y R_x p_shape, R_x about x first.
struct ShapeOptions {
  std::string name;  ///< one of shape_names(), or "plane" for an opaque object; empty: the file's
  std::filesystem::path
      file;  ///< .obj .off .ply .stl; .vdb with a level set; .mesh .msh .vtk with tetrahedra
  double unit_mm = 1.0;  ///< length of the file's unit
  double size_mm = 0.0;  ///< largest extent; 0: a file's own
  bool centred = false;  ///< whether the file's bounding box is moved to the origin first
  Vec3 position;
  std::array<double, 3> rotation_degrees{};  ///< about x, y, z
};

/// How a material's block lies in a shape: the shape is cut from it, or it is laid around the shape.
enum class Placement : std::uint8_t { kSolid, kShell };
enum class Tiling : std::uint8_t { kClamp, kRepeat, kMirror };

/// A second set of coefficients in a solid pattern, mixed logarithmically with weight w: c = c_0^(1-w) c_1^w.
///
///   veins   w = |sin(pi (x / size + noise))|^sharpness inverted: thin sheets of the second set through the first,
///           bent by three octaves of gradient noise (Perlin, An image synthesizer, 1985, his marble)
///   layers  w = 0 below and 1 above the plane z = 0 of the shape, in steps of size: 0 1 0 1 ...
struct PatternOptions {
  enum class Kind : std::uint8_t { kNone, kVeins, kLayers };
  Kind kind = Kind::kNone;
  double size_mm = 5.0;                      ///< of one period, > 0
  Colour absorption{0.01, 0.01, 0.01};       ///< 1/mm, > 0
  Colour reduced_scattering{1.0, 1.0, 1.0};  ///< 1/mm, > 0
};

/// What a translucent object is made of.
struct TranslucentOptions {
  std::filesystem::path file;  ///< a material.vdb; empty: homogeneous, or a pattern
  Placement placement = Placement::kSolid;
  double shell_depth_mm = 0.0;      ///< how deep the block reaches as a shell; 0: as thick as it is
  Vec3 origin;                      ///< where the file's block begins, in the shape's own frame, mm
  double scale = 1.0;               ///< of the block's lengths; coefficients stay per mm
  Tiling tiling = Tiling::kMirror;  ///< beyond the block
  Colour absorption{0.01, 0.01, 0.01};
  Colour reduced_scattering{1.0, 1.0, 1.0};
  PatternOptions pattern;
  double ior = 1.3;  ///< 1 to 3; a file brings its own
  std::filesystem::path
      surface_reflectance;  ///< of the file's session (render/scene/measured_finish.h); empty: none
  int edit_cells =
      96;  ///< along the longest side of the block that strokes go into, where there is no file; 1 to 1024
};

enum class SpecularModel : std::uint8_t { kNone, kCookTorrance, kWard };

/// How a surface mirrors (render/scene/specular.h).
struct SurfaceOptions {
  SpecularModel specular = SpecularModel::kCookTorrance;
  double roughness = 0.2;  ///< root mean square slope of the facets, 0.01 to 1
};

struct ObjectOptions {
  enum class Kind : std::uint8_t { kTranslucent, kOpaque };
  std::string name = "object";
  Kind kind = Kind::kTranslucent;
  ShapeOptions shape;
  TranslucentOptions material;  ///< of a translucent one
  std::vector<EditOptions>
      edits;  ///< of a translucent one: strokes in its material, one after another
  DeformOptions deform;
  Colour reflectance{0.5, 0.5, 0.5};  ///< of an opaque one: Lambert's, 0 to 1
  double opaque_ior = 1.0;            ///< of an opaque one's coat; 1: none, so matte
  SurfaceOptions surface;
};

struct LightOptions {
  enum class Kind : std::uint8_t { kDirectional, kPoint, kSpot, kDisc };
  std::string name = "light";
  Kind kind = Kind::kDirectional;
  Vec3 direction{0.0, 0.0, -1.0};  ///< in which it shines (directional, spot, disc); any length > 0
  Vec3 position{};                 ///< (point, spot; a disc's middle)
  Colour irradiance{1.0, 1.0, 1.0};  ///< on a surface across the light, W/mm^2 (directional)
  Colour intensity{1e3, 1e3, 1e3};   ///< W/sr (point, spot)
  double cone_degrees = 20.0;        ///< between axis and rim (spot)
  double blur_degrees = 4.0;         ///< over which the rim fades, inwards (spot)
  Colour radiance{
      1.0, 1.0, 1.0};       ///< W/(mm^2 sr), the same in all directions on its bright side (disc)
  double radius_mm = 10.0;  ///< (disc)
  int samples = 16;         ///< points that stand for it, 1 to 256 (disc)
  bool shadows = true;
};

/// The same radiance from everywhere.
struct EnvironmentOptions {
  Colour radiance{};  ///< W/(mm^2 sr)
  int rays = 64;      ///< towards it from each place, to find what hides it; 0: nothing does
};

struct CameraOptions {
  Vec3 position{40.0, 20.0, 30.0};
  Vec3 target;
  Vec3 up{0.0, 0.0, 1.0};
  double field_of_view_degrees = 30.0;  ///< of the picture's height
};

struct PictureOptions {
  int width = 640;
  int height = 480;
  int samples_per_axis = 3;  ///< of a pixel at an edge; elsewhere one ray does
  int refinement =
      1;  ///< how often the surface's triangles are cut into four that follow the shape
  double exposure = 0.0;  ///< stops
  double white =
      0.0;  ///< radiance shown as white at exposure 0; 0: all but the brightest half per cent are below it
  Colour background{};       ///< as shown, linear, 0 to 1
  bool transparent = false;  ///< PNG with alpha, in place of the background
};

enum class Discretisation : std::uint8_t { kGraph, kElements, kPolygrid };

/// How the light of lamps goes on behind the surface (docs/physics.md, "How light enters"); an environment's is diffuse.
enum class Entry : std::uint8_t { kCollimated, kDiffuse };

/// Whether what is lit stands still, or a hand is moving it and the picture shall follow at once.
enum class Pace : std::uint8_t { kAtRest, kMoving };

struct DiffusionOptions {
  static constexpr int kAutomatic = -1;

  Discretisation method = Discretisation::kElements;
  Entry entry = Entry::kCollimated;  ///< a polygrid takes kDiffuse whatever this is
  int directions =
      kAutomatic;  ///< in which diffuse light is followed behind each face to where it scatters first; 0: it enters at the
                   ///< surface; automatic: 4, and not for what moves (Subsurface::light())
  bool single_scattering =
      false;  ///< whether what beams scatter first is seen as itself (single_scattering.h), not by diffusion
  double tetrahedra = 1e5;       ///< about so many an object, if they were all of one size; or
  double spacing_mm = 0.0;       ///< this edge of the lattice; 0: from `tetrahedra`
  double interior_growth = 0.1;  ///< the papers' K
  GraphWeights weights = GraphWeights::kTwoPoint;  ///< of kGraph
  double tolerance = 1e-4;                         ///< relative residual
  int corrections = 8;  ///< of a graph's links that lean, at most so many a solution; 0: none
  int max_iterations = 300;
  int levels =
      20;  ///< of the multiresolution hierarchy, at most; 1: conjugate gradients with smoothing alone
  reconstruct::diffusion::BoundaryModel boundary =
      reconstruct::diffusion::BoundaryModel::kTwoMoment;
};

struct Scene {
  std::string name = "scene";
  PictureOptions picture;
  CameraOptions camera;
  EnvironmentOptions environment;
  DiffusionOptions diffusion;
  std::vector<LightOptions> lights;
  std::vector<ObjectOptions> objects;
};

/// Errors: kInvalidArgument, naming the object or light, for values that are out of range or contradict each other: no
///         object, both or neither of name and file, a camera at its target or with `up` along its view, a dark light.
Result<void> validate(const Scene& scene);

}  // namespace opaline::render
