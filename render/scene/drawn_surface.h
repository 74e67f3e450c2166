#pragma once

#include <array>
#include <vector>

#include "render/deform/deformation.h"
#include "render/graph/optics.h"
#include "render/mesh/signed_distance.h"
#include "render/mesh/triangle_mesh.h"

namespace opaline::render {

/// A surface made finer for the eye: each triangle cut into four, as often as asked, the new corners moved onto the
/// solid's own surface along the gradient of its signed distance, but by no more than half an edge.
class DrawnSurface {
 public:
  DrawnSurface(TriangleMesh coarse, const SignedDistance& solid, int refinement);
  /// As it is, where there is no solid to follow.
  explicit DrawnSurface(TriangleMesh mesh);

  /// Moves the surface from where it was at rest; its normals turn with it.
  void bend(const Deformation& deformation);

  /// Where a vertex is when nothing is bent, and its normal there.
  Vec3 rest_place(int vertex) const {
    return rest_.empty() ? mesh_.vertices[vertex] : rest_[vertex];
  }
  Vec3 rest_normal(int vertex) const {
    return rest_normals_.empty() ? normals_[vertex] : rest_normals_[vertex];
  }

  const TriangleMesh& mesh() const { return mesh_; }
  /// Of each vertex: of the signed distance, else of the triangles around it.
  const std::vector<Vec3>& normals() const { return normals_; }
  /// Values of the coarse vertices on all of them: a new vertex has the mean of the two it lies between.
  SurfaceLight spread(const SurfaceLight& of_coarse) const;
  /// 1 where a coarse vertex is marked, 0 where not, the mean between.
  std::vector<float> spread_marks(const std::vector<bool>& of_coarse) const;
  std::vector<float> spread_shares(std::vector<float> of_coarse) const;
  std::size_t coarse() const { return coarse_; }

 private:
  void refine(const SignedDistance& solid);

  TriangleMesh mesh_;
  std::vector<Vec3> normals_;
  std::vector<Vec3> rest_;  // of the vertices, and their normals
  std::vector<Vec3> rest_normals_;
  std::size_t coarse_ = 0;
  std::vector<std::array<int, 2>> parents_;  // of the vertices after the coarse ones
};

}  // namespace opaline::render
