#pragma once

#include <span>

#include "reconstruct/diffusion/boundary.h"
#include "render/graph/optics.h"
#include "render/solver/lane_matrix.h"
#include "render/tetrahedra/tet_mesh.h"

namespace opaline::render {

/// Linear finite elements on the vertices of the tetrahedra (Arridge et al., A
/// finite element approach for modeling photon transport in tissue, 1993),
/// coefficients constant in each: the reference for the graph, over the same
/// tetrahedra.
///
///   sum_tets kappa V grad_i . grad_k phi_k + sigma_a M_ik phi_k + 1 / (2 A)
///   B_ik phi_k = 1 / (2 A) B_ik S_k
///
/// M and B: consistent masses of tetrahedra and surface triangles; S = 4 q / (1
/// - R_phi); J_n = (phi - S) / (2 A).
///
/// Shapes: optics one a tetrahedron; q and the answers one a vertex of the
/// mesh, 0 in its interior.
class FiniteElements {
 public:
  /// The mesh must outlive it. Errors: kInvalidArgument, see validate(optics),
  /// or shapes differ.
  static Result<FiniteElements> create(const TetMesh& mesh,
                                       std::span<const Optics> optics,
                                       const reconstruct::diffusion::Boundary& boundary);

  /// Takes other coefficients, and the mesh as it is now, its vertices moved and its tetrahedra the same; the matrix
  /// keeps its pattern. Errors: as create().
  Result<void> update(std::span<const Optics> optics);

  const LaneMatrix<double>& matrix() const { return matrix_; }
  std::vector<Lanes<double>> load(std::span<const std::array<float, 3>> q) const;
  /// The same of light at any places: `places_of` has, for each of the triangles of surface_of(), those of its corners and of the middles of
  /// its edges, the k-th from corner k to the next, so that the sides of a crease may differ. Linear in each quarter of a triangle: what
  /// has a kink within a triangle, as light has where it begins to graze, or curves there, is off by a quarter.
  std::vector<Lanes<double>> load(std::span<const std::array<float, 3>> q,
                                  std::span<const std::array<int, 6>> places_of) const;
  /// The edges of the surface, by vertices of the mesh.
  const std::vector<std::array<int, 2>>& surface_edges() const { return edges_; }
  /// The edges of each of the triangles of surface_of(), the k-th from its corner k to the next.
  const std::vector<std::array<int, 3>>& edges_of_triangles() const { return edges_of_; }
  SurfaceLight surface_light(std::span<const std::array<float, 3>> q,
                             const std::vector<Lanes<double>>& phi) const;
  /// A third of the areas of the surface triangles around each vertex; 0
  /// inside.
  const std::vector<double>& surface_areas() const { return areas_; }

 private:
  FiniteElements(const TetMesh& mesh, const reconstruct::diffusion::Boundary& boundary);
  void add_volume(std::size_t tet, const Optics& optics);
  void add_surface(const std::array<int, 3>& triangle);

  const TetMesh* mesh_;
  reconstruct::diffusion::Boundary boundary_;
  std::vector<std::array<int, 3>> surface_;
  std::vector<std::array<int, 2>> edges_;
  std::vector<std::array<int, 3>> edges_of_;
  std::vector<double> areas_;
  LaneMatrix<double> matrix_;
};

}  // namespace opaline::render
