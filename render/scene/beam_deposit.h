#pragma once

#include <array>
#include <limits>
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

/// Light that starts anywhere inside.
struct InnerBeam {
  int tet = 0;
  Vec3 place;
  Vec3 along;                     ///< of length 1
  std::array<double, 3> power{};  ///< W
  double deepest_step =
      std::numeric_limits<double>::infinity();  ///< optical depth of one deposit, at most
};

/// Where beams scatter first: from tetrahedron to tetrahedron, with sigma_t' = 1 / (3 kappa) and alpha' = 1 - 3 kappa sigma_a,
///
///   E_0 = 1,  E_n = E_(n-1) e^(-t_n),  t_n = l_n sigma_t',   Q_n = P alpha' (E_(n-1) - E_n)     (docs/physics.md, "collimated")
///
/// put down at the centroid of what scatters along l_n, l_n (1 / t_n - 1 / (e^t_n - 1)) from where the beam came in. At the
/// surface R of what arrives is mirrored (Fresnel) and goes on, 1 - R leaves unscattered.
///
/// Threads: follow() may be called from several threads.
class BeamDeposit {
 public:
  /// Needs a valid mesh, coefficients one a tetrahedron, and ior >= 1.
  BeamDeposit(TetMesh mesh, std::vector<Optics> optics, double ior);

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
  double ior() const { return ior_; }

  struct Deposit {
    int tet = 0;
    std::array<double, 3> power{};                   ///< Q, W
    std::array<std::array<double, 4>, 3> corners{};  ///< of each channel's place: barycentric
  };
  /// Calls visit(Deposit) along the beam until a ten-thousandth of it is left, and leave(face, power) for what passes a face.
  template <class Visit, class Leave>
  void follow(const InnerBeam& beam, const Visit& visit, const Leave& leave) const {
    Walk walk{beam.power, beam.along, beam.place, beam.tet, beam.deepest_step};
    while (walk.tet >= 0) {
      visit(step(walk));
      if (walk.reached >= 0) leave(walk.reached, mirror(walk));
    }
  }
  template <class Visit>
  void follow(const InnerBeam& beam, const Visit& visit) const {
    follow(beam, visit, [](int, const std::array<double, 3>&) {});
  }
  /// Where a ray from inside leaves, and the share of each channel that gets there; face -1: less than a ten-thousandth does.
  struct WayOut {
    int face = -1;
    Vec3 place;
    std::array<double, 3> left{};
  };
  WayOut way_out(int tet, Vec3 place, Vec3 along) const;
  InnerBeam behind(const Beam& beam) const {
    const Face& face = faces_[beam.face];
    return {.tet = face.tet, .place = face.middle.place, .along = beam.along, .power = beam.power};
  }

 private:
  struct Walk {
    std::array<double, 3> power{};
    Vec3 along;
    Vec3 place;
    int tet = -1;
    double deepest_step = std::numeric_limits<double>::infinity();
    int came_through = -1;  // the face's number in the tetrahedron
    int reached = -1;       // a face of the surface
    std::array<double, 3> left{1.0, 1.0, 1.0};
    int steps = 0;
  };
  struct Crossing {
    std::array<double, 4> here{};   // barycentric coordinates
    std::array<double, 4> slope{};  // how they change along the beam
    double length = 0.0;
    int out = -1;        // the face through which it goes on
    bool stays = false;  // or it ends inside
  };
  struct Corner {  // its barycentric coordinate is gradient . p + offset
    Vec3 gradient;
    double offset = 0.0;
  };
  Crossing cross_tet(const Walk& walk) const;
  void go_on(Walk& walk, const Crossing& crossing, bool is_spent) const;
  Deposit step(Walk& walk) const;
  /// Turns a walk back at the surface; the power that leaves there.
  std::array<double, 3> mirror(Walk& walk) const;
  void place_corners();

  TetMesh mesh_;
  std::vector<Optics> optics_;
  double ior_;
  std::vector<std::array<Corner, 4>> corners_;
  std::vector<std::array<int, 4>> neighbours_;  // -1 - f: face f of the surface
  std::vector<Face> faces_;
};

}  // namespace opaline::render
