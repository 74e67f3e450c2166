#pragma once

#include <array>
#include <cstddef>
#include <limits>
#include <optional>
#include <stop_token>
#include <vector>

#include "render/mesh/triangle_mesh.h"

namespace opaline::render {

struct Ray {
  Vec3 origin;     ///< mm
  Vec3 direction;  ///< of length 1
};

/// Where a ray meets a mesh: the point is the corners' average with these weights.
struct RayHit {
  std::size_t triangle = 0;
  std::array<double, 3> weights{};  ///< of the triangle's corners; their sum is 1
  double distance = 0.0;            ///< along the ray, mm
};

/// A tree of bounding boxes over the triangles of a mesh, halved at the median of their centres along the longest axis, for
/// rays: the box by slabs (Kay & Kajiya, Ray tracing complex scenes, 1986), the triangle after Moller & Trumbore (Fast,
/// minimum storage ray/triangle intersection, 1997), from either side.
///
/// Threads: queries may run at once.
class TriangleTree {
 public:
  /// The mesh must outlive it. Errors: kInvalidArgument, see validate(); kCancelled.
  static Result<TriangleTree> create(const TriangleMesh& mesh, const std::stop_token& stop = {});

  /// The mesh's vertices have moved: the boxes follow, the order stays, which costs speed where triangles that were near
  /// each other no longer are.
  void refit();

  /// The nearest triangle further along the ray than `beyond`, mm.
  std::optional<RayHit> nearest(const Ray& ray, double beyond = 0.0) const;
  /// Whether anything lies on the ray between `beyond` and `before`, mm: a shadow.
  bool blocked(const Ray& ray,
               double beyond,
               double before = std::numeric_limits<double>::infinity()) const;

 private:
  struct Node {
    Box box;
    int first = 0;  // triangles of a leaf
    int count = 0;  // 0: an inner node
    int right = 0;  // second child; the first follows its parent
  };

  TriangleTree(const TriangleMesh& mesh, const std::stop_token& stop);
  int build(int first, int last, const std::stop_token& stop);
  Box box_of(int first, int last) const;
  Vec3 corner(std::size_t triangle, int k) const;
  Vec3 centre(std::size_t triangle) const;
  std::optional<RayHit> meet(const Ray& ray, std::size_t triangle) const;
  template <class Visit>
  void walk(const Ray& ray, double beyond, const double& before, const Visit& visit) const;

  const TriangleMesh* mesh_;
  std::vector<std::size_t> order_;
  std::vector<Node> nodes_;
};

}  // namespace opaline::render
