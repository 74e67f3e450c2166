#pragma once

#include <array>
#include <span>
#include <vector>

#include "render/mesh/signed_distance.h"
#include "render/mesh/triangle_mesh.h"
#include "render/scene/surfaces.h"

namespace opaline::render {

/// Where light is asked for on each triangle of a surface: at its corners and, where they are used, in the middles of its edges, the k-th from
/// corner k to the next. Numbers of places; -1: not used.
using TrianglePlaces = std::array<int, 6>;

/// Places where a surface has a crease. One normal cannot stand for both sides there, and what lies between them lies too much in the light: each
/// triangle gets a place of its own, with the normal that the solid has beside it.
///
/// A place is at a crease where the distance has no one gradient, and for a triangle whose own normal, and the solid's a little way into the
/// triangle, turn from the place's by more than kCrease.
class Creases {
 public:
  static constexpr double kCrease = 0.9;  ///< cosine, 26 degrees

  Creases() = default;
  /// Adds the new places after the others and makes the triangles use them.
  static Creases split(const SignedDistance& solid,
                       const TriangleMesh& surface,
                       std::vector<SurfacePlace>& places,
                       std::vector<TrianglePlaces>& triangles);

  /// The new places on a surface that has moved, whose other places have moved; with the normals of its triangles.
  void append(const TriangleMesh& surface, std::vector<SurfacePlace>& places) const;

  /// Light at the corner of several triangles is the mean over their areas at rest.
  struct Corner {
    int vertex = 0;
    std::vector<int> places;
    std::vector<float> weights;  // their sum is 1
  };
  const std::vector<Corner>& corners() const { return corners_; }

 private:
  struct Part {
    int triangle = 0;
    int place = 0;  // that it was split from
  };
  std::vector<Part> parts_;
  std::vector<Corner> corners_;
};

}  // namespace opaline::render
