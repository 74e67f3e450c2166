#pragma once

#include <array>
#include <vector>

#include "base/pose.h"
#include "render/tetrahedra/tet_mesh.h"

namespace opaline::render {

/// The four-connected graph of a solid's tetrahedra (Wang et al., Real-time
/// rendering of translucent materials on QuadGraph, 2010, sec. 4.1): an inner
/// node in each tetrahedron, a surface node on each of its faces that lies on
/// the surface; each inner node has four links, through its faces, and each
/// surface node one. Tetrahedra with two or three faces on the surface keep
/// them (the paper cuts them further): a node has four links all the same.
///
/// Inner nodes are the centroids, surface nodes the centroids of faces. Units:
/// mm.
struct QuadGraph {
  struct Link {
    int inner = -1;       ///< the inner node beyond the face, or -1
    int surface = -1;     ///< the surface node on the face, or -1
    double area = 0.0;    ///< of the face, mm^2
    double reach = 0.0;   ///< from the node to the plane of the face, mm
    double length = 0.0;  ///< to the node that is linked, mm
  };
  struct SurfaceNode {
    Vec3 place;
    Vec3 normal;  ///< of the face, outwards
    int inner = 0;
    double area = 0.0;
    double reach = 0.0;   ///< of its inner node
    double length = 0.0;  ///< of its link
  };
  std::vector<Vec3> inner;
  std::vector<double> volumes;
  std::vector<std::array<Link, 4>> links;
  std::vector<SurfaceNode> surface;
};

/// Needs a valid mesh (validate()).
QuadGraph make_quad_graph(const TetMesh& mesh);

/// Makes places, areas, volumes and lengths those of the mesh as it is now, whose vertices have moved and whose
/// tetrahedra are those the graph was made from: the links stay.
void update_geometry(const TetMesh& mesh, QuadGraph& graph);

/// The same mesh with its tetrahedra layer by layer from one end to the other, each layer the neighbours of the one before
/// (Cuthill & McKee 1969), so that neighbours lie in one layer or the next: the paper's packing (sec. 5.1), for caches
/// instead of textures, and for sweeps (render/solver/sweep_matrix.h) that go from row to row. Vertices follow.
TetMesh pack(const TetMesh& mesh);

}  // namespace opaline::render
