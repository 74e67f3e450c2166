#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <stop_token>
#include <string>
#include <string_view>
#include <vector>

#include "render/mesh/signed_distance.h"
#include "render/scene/scene.h"
#include "render/tetrahedra/tet_mesh.h"

namespace opaline::render {

/// A rigid motion of a shape into the scene (ShapeOptions).
Pose scene_from_shape(const ShapeOptions& shape);

/// A solid moved rigidly.
class PlacedSolid final : public SignedDistance {
 public:
  PlacedSolid(std::unique_ptr<SignedDistance> solid, const Pose& scene_from_solid);
  double at(Vec3 point) const override { return solid_->at(solid_from_scene_.apply(point)); }
  Box bounds() const override { return bounds_; }

 private:
  std::unique_ptr<SignedDistance> solid_;
  Pose solid_from_scene_;
  Box bounds_;
};

/// A shape in the scene, as a solid and, where it came from a file, as the file's triangles.
struct LoadedShape {
  std::unique_ptr<SignedDistance> solid;
  std::optional<TriangleMesh> surface;
  std::optional<TetMesh> tets;     ///< where the file has them
  std::vector<std::string> notes;  ///< what a user should know of the file: holes, turned triangles
};

/// Hears what is being done now, where it takes long: "reading stone.stl".
using Saying = std::function<void(std::string_view)>;

/// Errors: those of read_mesh(), read_level_set() and make_shape(); kInvalidArgument for a file without extent; kCancelled.
Result<LoadedShape> load_shape(const ShapeOptions& shape,
                               const std::stop_token& stop = {},
                               const Saying& say = {});

/// A square in the plane z = 0 of its own frame that faces +z, cut into cells x cells x 2 triangles.
TriangleMesh plane_mesh(double size_mm, int cells);

/// The triangles of an opaque object: the file's, or those that isosurface stuffing with about so many tetrahedra leaves
/// of a shape by name; "plane" is plane_mesh(). `solid` is none for a plane.
Result<LoadedShape> load_opaque(const ShapeOptions& shape,
                                double tetrahedra,
                                std::stop_token stop,
                                const Saying& say = {});

}  // namespace opaline::render
