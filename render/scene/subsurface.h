#pragma once

#include <functional>
#include <memory>
#include <span>
#include <stop_token>
#include <string>
#include <vector>

#include "base/thread_team.h"
#include "reconstruct/diffusion/fluence_solver.h"
#include "render/deform/deformation.h"
#include "render/graph/optics.h"
#include "render/mesh/signed_distance.h"
#include "render/scene/beam_deposit.h"
#include "render/scene/creases.h"
#include "render/scene/first_scattering.h"
#include "render/scene/scene.h"
#include "render/scene/surfaces.h"
#include "render/tetrahedra/tet_mesh.h"

namespace opaline::render {

struct SubsurfaceSetting;

/// Light that is transmitted into the surface and diffuse behind it, W/mm^2, one value a place; none: it is dark.
struct DiffuseLight {
  std::span<const std::array<float, 3>> environment;
  std::span<const std::array<float, 3>> lamps;
  Pace pace = Pace::kAtRest;
};

/// How diffuse light went in.
enum class DiffuseEntry : std::uint8_t {
  kDark,
  kAtSurface,
  kFollowed,        ///< to where it scatters first
  kFollowedBefore,  ///< the same, in the material and the shape before they last changed
};

/// A solid in which light diffuses: cut up, its coefficients taken at each node, ready to be lit again and again, each
/// solution started from the one before.
///
///   graph      two-point volumes on the QuadGraph of its tetrahedra, single precision    (render/graph/two_point.h)
///   elements   linear finite elements on the same tetrahedra, double precision           (render/graph/finite_elements.h)
///   polygrid   two-point volumes on a lattice of the same spacing, single precision      (render/graph/polygrid.h)
///
/// Whatever carries the light, it is seen on the surface of the tetrahedra.
///
/// Threads: one call at a time.
class Subsurface {
 public:
  using MaterialAt = std::function<Optics(Vec3)>;

  struct Report {
    std::size_t tetrahedra = 0;
    std::size_t unknowns = 0;
    double spacing_mm = 0.0;
    double volume_mm3 = 0.0;
    double area_mm2 = 0.0;           ///< of the surface
    double smallest_dihedral = 0.0;  ///< degrees
    int components = 0;
    double shortest_diffusion_length =
        0.0;                          ///< min 1 / sigma_tr, mm; infinite where nothing is absorbed
    double shortest_free_path = 0.0;  ///< min 1 / (sigma_a + sigma_s'), mm
    double mesh_seconds = 0.0;
    double setup_seconds = 0.0;
  };

  /// The team must outlive it. Errors: those of stuff(), make_polygrid() and validate(optics); kCancelled.
  static Result<std::unique_ptr<Subsurface>> create(const SignedDistance& solid,
                                                    const MaterialAt& material,
                                                    double ior,
                                                    const DiffusionOptions& options,
                                                    ThreadTeam& team,
                                                    std::stop_token stop);
  /// The same of tetrahedra that somebody else has cut, which `solid` encloses. Needs a valid mesh.
  static Result<std::unique_ptr<Subsurface>> create(TetMesh mesh,
                                                    const SignedDistance& solid,
                                                    const MaterialAt& material,
                                                    double ior,
                                                    const DiffusionOptions& options,
                                                    ThreadTeam& team,
                                                    std::stop_token stop);
  virtual ~Subsurface() = default;

  /// Of the next solutions: the dial between speed and accuracy.
  void set_tolerance(double tolerance) { options_.tolerance = tolerance; }
  /// Takes the coefficients anew; the next solution starts from the last. Errors: see validate(optics).
  Result<void> set_material(const MaterialAt& material);
  /// Bends the solid as it was at rest; its graph stays. Answers how many tetrahedra that would turn inside out: where
  /// there are any, nothing has moved and inverted_corners() says where they are. Errors: kInvalidArgument on a polygrid, whose lattice
  /// cannot bend.
  Result<std::size_t> bend(const Deformation& deformation);
  /// Whether each vertex of surface() is a corner of a tetrahedron that the last bend() would have turned inside out.
  const std::vector<bool>& inverted_corners() const { return inverted_corners_; }

  const TriangleMesh& surface() const { return surface_; }
  const Report& report() const { return report_; }
  /// Where q is asked for. Of elements: the vertices of surface(), then the middles of edges(). Of a graph the middles of its
  /// triangles, of a lattice its boundary nodes; then the vertices.
  /// Last, for each triangle at a crease, what it sees of that in place of those (render/scene/creases.h).
  const std::vector<SurfacePlace>& places() const { return places_; }
  /// Of elements the edges of surface(), by its vertices; else none.
  const std::vector<std::array<int, 2>>& edges() const { return edges_; }
  /// What beams enter through; none on a polygrid, which has no tetrahedra to follow them in.
  const BeamDeposit* beams() const { return beams_.get(); }
  /// Leaves what beams scatter first to diffusion from now on (DiffusionOptions::single_scattering).
  void leave_out_single_scattering() { options_.single_scattering = false; }
  /// Solves for diffuse light and for beams. Where the options have directions, diffuse light is followed along them to where
  /// it scatters first (docs/physics.md), once while light, material and shape stay; what of it leaves unscattered is in lit(),
  /// as if it left diffusely; of beams it is not. With automatic directions nothing is followed anew while things move: the
  /// environment goes in as it was last followed, and so do lamps that have not moved; lamps that have enter at the surface.
  /// Errors: kCancelled; kInternal where the solution did not get below ten times the tolerance.
  Result<reconstruct::diffusion::SolveSummary> light(const DiffuseLight& diffuse,
                                                     std::span<const Beam> beams,
                                                     std::stop_token stop);
  /// The same at rest for light q of an environment.
  Result<reconstruct::diffusion::SolveSummary> light(std::span<const std::array<float, 3>> q,
                                                     std::span<const Beam> beams,
                                                     std::stop_token stop) {
    return light({.environment = q, .lamps = {}}, beams, std::move(stop));
  }
  /// How the last solution's diffuse light went in.
  DiffuseEntry environment_entry() const { return environment_.entry; }
  DiffuseEntry lamps_entry() const { return lamps_.entry; }
  /// Whether light() at rest would follow what the last solution has not.
  bool is_provisional() const { return is_provisional_; }
  /// Of the last solution, one value a vertex of surface().
  const SurfaceLight& lit() const { return lit_; }
  /// What of its beams leaves through each face of surface() after one scattering, W, where the options keep that apart: it
  /// is not in lit(). Else empty.
  const std::vector<std::array<double, 3>>& passed_once() const { return passed_once_; }

 protected:
  using Values = std::vector<std::array<float, 3>>;

  Subsurface(TetMesh mesh, const DiffusionOptions& options);

  /// Takes mesh_ and optics_ as they are now.
  virtual Result<void> assemble() = 0;
  /// Where the material is taken, at rest.
  virtual std::vector<Vec3> nodes() const = 0;
  virtual std::vector<SurfacePlace> flat_places() const = 0;
  virtual std::vector<std::array<int, 2>> edges_between() const { return {}; }
  /// The number of the first vertex's place; the others' follow.
  virtual std::size_t first_vertex_place() const = 0;
  /// Of flat_places() by triangles of surface(); here without middles.
  virtual std::vector<TrianglePlaces> flat_triangle_places() const;
  /// The same of places().
  const std::vector<TrianglePlaces>& triangle_places() const { return triangle_places_; }
  /// Of q, at the vertices; at a crease the mean of its sides.
  Values at_vertices(std::span<const std::array<float, 3>> q) const;
  /// The unknowns that light scatters into.
  virtual DepositAt deposit_at() const = 0;
  /// q in the middles of the faces of the surface, in the order of beams()->faces().
  virtual Values on_faces(std::span<const std::array<float, 3>> q) const {
    return {q.begin(), q.end()};
  }
  /// `scattered`: sources one an unknown, W; empty where there are none.
  virtual reconstruct::diffusion::SolveSummary solve(
      std::span<const std::array<float, 3>> q,
      std::span<const std::array<double, 3>> scattered,
      std::stop_token stop) = 0;
  /// The surface has another shape than before, or its first.
  virtual void look_at_shape() {}
  virtual SurfaceLight at_surface(std::span<const std::array<float, 3>> q) const = 0;

  reconstruct::diffusion::SolveOptions solve_options() const {
    return {.tolerance = options_.tolerance, .max_iterations = options_.max_iterations};
  }
  /// Works out the optics and lets the method begin with them.
  Result<void> begin(const SubsurfaceSetting& setting);

  TetMesh mesh_;
  std::vector<int> used_;  // the mesh's vertex of each of the surface's
  DiffusionOptions options_;
  std::vector<Optics> optics_;

 private:
  struct Followed {
    DiffuseEntry entry = DiffuseEntry::kDark;
    Values q;  // what `light` is of; empty: nothing was followed
    FirstScattering light;
    bool is_stale = false;  // material or shape have changed
  };
  bool follows() const { return options_.directions != 0 && beams_; }
  DiffuseEntry enter(Followed& part,
                     std::span<const std::array<float, 3>> q,
                     bool as_before,
                     Pace pace,
                     const std::stop_token& stop);
  void show_passed(const std::vector<std::array<double, 3>>& passed);

  void sample(const MaterialAt& material);
  void note_lengths();
  void follow_anew();

  TriangleMesh surface_;
  std::vector<SurfacePlace> places_;
  std::vector<std::array<int, 2>> edges_;
  Report report_;
  ThreadTeam* team_ = nullptr;
  std::vector<Vec3> rest_;   // of mesh_'s vertices
  std::vector<Vec3> nodes_;  // at rest
  std::vector<SurfacePlace> rest_places_;
  std::vector<TrianglePlaces> triangle_places_;
  Creases creases_;
  std::vector<bool> inverted_corners_;
  SurfaceLight lit_;
  std::vector<std::array<double, 3>> passed_once_;
  std::unique_ptr<BeamDeposit> beams_;
  double two_a_ = 2.0;  // of the boundary condition
  Followed environment_;
  Followed lamps_;
  bool is_provisional_ = false;
};

}  // namespace opaline::render
