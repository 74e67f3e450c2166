#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <stop_token>
#include <vector>

#include "base/pose.h"
#include "base/result.h"

namespace opaline::sim {

/// A solid of tetrahedra that meet face to face, as plain data; coefficients constant in each, 1/mm. Scattering is isotropic
/// (the similarity principle: sigma_s (1 - g)).
struct TetSolid {
  std::vector<Vec3> vertices;  ///< mm
  std::vector<std::array<int, 4>> tets;
  std::vector<double> absorption;
  std::vector<double> scattering;
  double ior = 1.0;  ///< relative to what is around it
};

/// A face of one tetrahedron only: the one opposite its corner `opposite`.
struct TetFace {
  int tet = 0;
  int opposite = 0;
};

/// How light goes on behind the face through which it enters.
enum class TetEntry : std::uint8_t {
  kDiffuse,  ///< as light does that falls on it evenly from everywhere: what Fresnel lets pass, refracted (Snell)
  kCollimated,  ///< along `direction`, refracted (Snell)
};

struct TetTransportOptions {
  TetEntry entry = TetEntry::kDiffuse;
  Vec3 direction{0.0, 0.0, -1.0};  ///< outside, in which collimated light travels
  bool count_unscattered = true;   ///< whether light that leaves without a collision is tallied
  Vec3 seen{0.0, 0.0, 1.0};        ///< only light that leaves within an angle about this is tallied
  double seen_cosine = -1.0;       ///< the angle's cosine; -1: all light is
  bool count_first = false;        ///< whether first collisions are tallied
  std::uint64_t photons = 1'000'000;
  std::uint64_t seed = 1;
  int threads = 1;
};

/// What leaves through each patch of the surface, in units of all light that entered.
struct TetTransportResult {
  std::vector<double> left;            ///< of each patch
  std::vector<double> standard_error;  ///< of `left`, from batches
  std::vector<double> first;  ///< scattered for the first time in each tetrahedron, where counted
  double absorbed = 0.0;
  double unscattered = 0.0;  ///< left without a collision, tallied or not
};

/// Faces on the surface, by tetrahedron, then by corner: their order everywhere here.
std::vector<TetFace> surface_faces(const TetSolid& solid);

/// Monte Carlo light transport from tetrahedron to tetrahedron (Fang, Mesh-based Monte Carlo method using fast ray-tracing in
/// Pluecker coordinates, 2010, with planes instead): flights end where the optical depth of scattering drawn for them is
/// used up, absorption takes its share along the way, and at the surface Fresnel's reflectance decides. What has left does
/// not enter again. Shares nothing with what renders.
///
/// Shapes:  `power` that enters each face and `patch` (0 and on) that it belongs to, in the order of surface_faces().
/// Threads: its own; the answer does not depend on how many.
/// Errors:  kInvalidArgument for shapes or coefficients that make no sense, or a solid without light; kCancelled.
Result<TetTransportResult> trace_tets(const TetSolid& solid,
                                      std::span<const double> power,
                                      std::span<const int> patch,
                                      const TetTransportOptions& options,
                                      std::stop_token stop);

}  // namespace opaline::sim
