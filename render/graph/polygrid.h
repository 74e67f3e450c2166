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
/// Where the open faces of a node look at sides of the surface whose normals differ by more than 45 degrees, as at a cube's edges
/// and in a sheet one node thick, each side has a boundary node of its own, on the plane through where the lattice's line meets it.
///
/// Adaptive with depth (Wang 2008, sec. 5): eight nodes become one of twice the spacing, and so on, where they lie so deep that
/// spacing + K depth allows it, away from the surface, and where no neighbour then is less than half as large. Towards smaller
/// neighbours a node has four links, which lean: a small error, where the light is smooth.
///
/// What is thinner than h may be missed. Units: mm.
struct Polygrid {
  using Link = QuadGraph::Link;
  using SurfaceNode = QuadGraph::SurfaceNode;

  double spacing = 1.0;
  std::vector<Vec3> inner;
  std::vector<double> volumes;
  /// Towards -x, +x, -y, +y, -z, +z, one each or four; neither inner nor surface: nothing there.
  std::vector<std::vector<Link>> links;
  std::vector<SurfaceNode> surface;
};

inline constexpr std::size_t kMostPolygridPlaces = 200'000'000;

/// Nodes at the centres of cells of `spacing_mm`, or of 2, 4, ... times that, in the order of their lowest corners, x fastest;
/// `interior_growth` is K, 0: all of one size.
/// Errors: kInvalidArgument for a spacing that is not > 0, K below 0, a lattice of more than kMostPolygridPlaces, or a solid without a
///         node; kCancelled.
Result<Polygrid> make_polygrid(const SignedDistance& solid,
                               double spacing_mm,
                               double interior_growth,
                               std::stop_token stop);

}  // namespace opaline::render
