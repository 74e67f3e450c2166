#pragma once

#include <cstdint>
#include <string_view>

#include "base/result.h"

namespace opaline::reconstruct::diffusion {

/// Which A the boundary condition  phi + 2 A kappa dphi/dn = 4 q / (1 - R_phi)  takes
/// (docs/physics.md, "Boundary").
enum class BoundaryModel : std::uint8_t {
  kTwoMoment,  ///< (1 + R_j) / (1 - R_phi): conserves energy towards the camera (Haskell et al.
               ///< 1994)
  kJensen,     ///< (1 + Fdr) / (1 - Fdr), Fdr exact (Jensen et al. 2001, sec. 2.1)
  kKeijzer,    ///< closed form of Keijzer et al. 1988, as in Schweiger et al. 1995
  kMilne,      ///< two_moment's and 3/2 0.710446 - 1: at a matched index the extrapolation length
               ///< 2 A kappa is that of Milne's problem (Hopf 1934), 0.710446 transport mean free
               ///< paths, in place of 2/3; at other indices the same excess, an assumption
};
std::string_view to_string(BoundaryModel model);  ///< "two_moment" | "jensen" | "keijzer" | "milne"

/// The boundary's constants for one refractive index.
struct Boundary {
  double a = 1.0;             ///< A
  double source_scale = 4.0;  ///< 4 / (1 - R_phi)

  /// Per area, of a boundary face at h/2 from its cell's centre: g_b = 1 / (2 A + h / (2 kappa)),
  /// dimensionless. Net flux out F = g_b (phi - source_scale q), exitance M = q + F.
  double conductance(double h, double kappa) const { return 1.0 / (2.0 * a + 0.5 * h / kappa); }
};

/// Errors: kInvalidArgument when `ior` is not within 1 to 3.
Result<Boundary> make_boundary(BoundaryModel model, double ior);

}  // namespace opaline::reconstruct::diffusion
