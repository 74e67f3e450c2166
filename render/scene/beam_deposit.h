#pragma once

#include <array>
#include <span>
#include <vector>

#include "render/graph/optics.h"
#include "render/scene/surfaces.h"
#include "render/tetrahedra/tet_mesh.h"

namespace opaline::render {

/// Collimated light that has entered through a face of the surface.
struct Beam {
  int face = 0;
  Vec3 along;                     ///< inside, of length 1
  std::array<double, 3> power{};  ///< transmitted, W
};

/// Where beams scatter first: from tetrahedron to tetrahedron, with sigma_t' = 1 / (3 kappa) and alpha' = 1 - 3 kappa sigma_a,
///
///   E_0 = 1,  E_n = E_(n-1) e^(-t_n),  t_n = l_n sigma_t',   Q_n = P alpha' (E_(n-1) - E_n)     (docs/physics.md, "collimated")
///
/// put down at the centroid of what scatters along l_n, l_n (1 / t_n - 1 / (e^t_n - 1)) from where the beam came in; what
/// reaches the surface leaves unscattered.
///
/// Threads: visit() may be called from several threads.
class BeamDeposit {
 public:
  /// Needs a valid mesh and coefficients one a tetrahedron.
  BeamDeposit(TetMesh mesh, std::vector<Optics> optics);

  /// Takes other places of the same vertices, and other coefficients.
  void update(const std::vector<Vec3>& vertices, const std::vector<Optics>& optics);

  /// The faces of the surface: a ray's start in the middle of each, its outward normal and its area.
  struct Face {
    SurfacePlace middle;
    int tet = 0;
    double area = 0.0;
  };
  const std::vector<Face>& faces() const { return faces_; }
  const TetMesh& mesh() const { return mesh_; }

  struct Deposit {
    int tet = 0;
    std::array<double, 3> power{};                   ///< Q, W
    std::array<std::array<double, 4>, 3> corners{};  ///< of each channel's place: barycentric
  };
  /// Calls visit(Deposit) along the beam until a ten-thousandth of it is left.
  template <class Visit>
  void follow(const Beam& beam, const Visit& visit) const {
    Walk walk{beam, faces_[beam.face].middle.place, faces_[beam.face].tet};
    while (walk.tet >= 0) visit(step(walk));
  }

 private:
  struct Walk {
    const Beam& beam;
    Vec3 place;
    int tet = -1;
    int from = -1;  // the tetrahedron before
    std::array<double, 3> left{1.0, 1.0, 1.0};
    int steps = 0;
  };
  Deposit step(Walk& walk) const;
  void place_faces();

  TetMesh mesh_;
  std::vector<Optics> optics_;
  std::vector<std::array<int, 4>> neighbours_;
  std::vector<Face> faces_;
};

}  // namespace opaline::render
