#pragma once

#include <array>
#include <memory>
#include <stop_token>
#include <vector>

#include "render/mesh/signed_distance.h"
#include "render/mesh/triangle_mesh.h"

namespace opaline::render {

/// The signed distance of a triangle mesh, closed or not. How far is the distance to the nearest triangle; inside is where
/// the mesh winds around the point by more than a half,
///
///   w(p) = 1 / (4 pi) sum of the solid angles of the triangles seen from p
///                                        (Jacobson et al., Robust inside-outside segmentation, 2013; far groups of
///                                         triangles as dipoles, beyond twice their radius: Barill et al. 2018)
///
/// so holes are closed as a soap film would, what overlaps is joined, and stray sheets enclose nothing. A mesh that is
/// inside out as a whole is turned around.
///
/// Beside a hole, where w goes through 1/2 far from any triangle, how far is |w - 1/2| / |grad w| if that is less: the film
/// is smooth where tetrahedra are cut at it.
///
/// Both sums go through one tree of bounding boxes: some microseconds a point for 100,000 triangles.
class MeshDistance final : public SignedDistance {
 public:
  /// Errors: kInvalidArgument for what validate() refuses, and where all triangles are without area; kCancelled.
  static Result<std::unique_ptr<MeshDistance>> create(const TriangleMesh& mesh,
                                                      const std::stop_token& stop = {});

  double at(Vec3 point) const override;
  Box bounds() const override { return bounds_; }

  double unsigned_at(Vec3 point) const;
  double winding(Vec3 point) const;  ///< about 1 inside, 0 outside

 private:
  struct Triangle {
    Vec3 a;
    Vec3 b;
    Vec3 c;
  };
  struct Node {
    Box box;
    Vec3 centroid;        // of area
    Vec3 dipole;          // sum of area times normal
    double radius = 0.0;  // around the centroid
    int first = 0;        // triangles of a leaf
    int count = 0;        // 0: an inner node
    int right = 0;        // second child; the first follows its parent
  };
  MeshDistance(const TriangleMesh& mesh, const std::stop_token& stop);
  double to_film(Vec3 point, double around, double clear) const;
  int build(int first, int last, const std::stop_token& stop);
  void summarise(Node& node, int first, int last) const;

  std::vector<Triangle> triangles_;
  std::vector<Node> nodes_;
  Box bounds_;
  double orientation_ = 1.0;
};

}  // namespace opaline::render
