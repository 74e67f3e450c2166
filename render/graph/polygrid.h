#pragma once

#include <array>
#include <cstddef>
#include <stop_token>
#include <vector>

#include "base/result.h"
#include "render/graph/quad_graph.h"
#include "render/mesh/signed_distance.h"

namespace opaline::render {

/// Wang 2008's polygrid, built by itself: the nodes of a regular lattice inside a solid, each linked to its six neighbours, and
/// a boundary node on the surface for every node that lacks some.
///
/// A boundary node is the foot of the perpendicular from its node, at the signed distance along the true normal n, and stands
/// for the area that the node's open faces cover of the surface, h^2 sum max(0, n . e): summed over a staircase that is the area
/// of the surface itself. (Conditions along the links instead stall at 5 to 6 % of error, docs/physics.md.) So TwoPoint serves
/// this graph as it serves a QuadGraph, and converges with h.
///
/// What is thinner than h may be missed. Units: mm.
struct Polygrid {
  using Link = QuadGraph::Link;
  using SurfaceNode = QuadGraph::SurfaceNode;

  double spacing = 1.0;
  std::vector<Vec3> inner;
  std::vector<double> volumes;
  std::vector<std::array<Link, 6>>
      links;  ///< towards -x, +x, -y, +y, -z, +z; neither inner nor surface: nothing there
  std::vector<SurfaceNode> surface;
};

inline constexpr std::size_t kMostPolygridPlaces = 200'000'000;

/// Nodes at the centres of cells of `spacing_mm`, in the order x fastest.
/// Errors: kInvalidArgument for a spacing that is not > 0, a lattice of more than kMostPolygridPlaces, or a solid without a
///         node; kCancelled.
Result<Polygrid> make_polygrid(const SignedDistance& solid,
                               double spacing_mm,
                               std::stop_token stop);

}  // namespace opaline::render
