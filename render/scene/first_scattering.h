#pragma once

#include <array>
#include <span>
#include <stop_token>
#include <vector>

#include "base/thread_team.h"
#include "render/scene/beam_deposit.h"

namespace opaline::render {

/// What becomes of beams: the source of the diffused light, and what leaves without having been scattered.
struct FirstScattering {
  std::vector<std::array<double, 3>> scattered;  ///< W; one a tetrahedron, or one a vertex
  std::vector<std::array<double, 3>> passed;     ///< W through each face of the surface
};

enum class DepositAt : std::uint8_t { kTetrahedra, kVertices };

/// Follows beams, a share of them in each thread of the team. At vertices, each deposit goes to the corners of its tetrahedron by its
/// barycentric coordinates. What is stopped is not to be used.
FirstScattering first_scattering(const BeamDeposit& deposit,
                                 std::span<const Beam> beams,
                                 DepositAt where,
                                 ThreadTeam& team,
                                 const std::stop_token& stop);

/// The same of light that was scattered in tetrahedra, W each: isotropic, from four places in each as `directions` beams, which are stratified
/// and differ from one to the next.
FirstScattering next_scattering(const BeamDeposit& deposit,
                                std::span<const std::array<double, 3>> scattered,
                                int directions,
                                DepositAt where,
                                ThreadTeam& team,
                                const std::stop_token& stop);

/// sin^2 inside of light that falls on a surface evenly from everywhere and passes it (Fresnel), refracted (Snell): below it lies
/// the share of it that is asked for. With s = sin^2 theta outside, that has the density 1 - R(s), and s / eta^2 is inside.
class RefractedCone {
 public:
  explicit RefractedCone(double ior);
  double sine_squared(double share) const;

 private:
  double ior_;
  std::vector<double> shares_;  // that come from s = k / (size - 1) and less
};

/// Light that goes on behind each face in all directions of the refracted cone, as `directions` beams of the same power a face.
/// They are stratified, and differ from face to face (Roberts' R2 sequence), so that few of them do: what a place gets comes
/// from many faces. `q` one a face, W/mm^2.
std::vector<Beam> diffuse_beams(const BeamDeposit& deposit,
                                std::span<const std::array<float, 3>> q,
                                int directions);

}  // namespace opaline::render
