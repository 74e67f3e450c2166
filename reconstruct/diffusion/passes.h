#pragma once

#include <concepts>
#include <span>

namespace opaline::reconstruct::diffusion {

/// The passes that a back end gives to conjugate_gradient.h. Fields stay on the back end, and so do
/// the scalars of conjugate gradients, one of each a right-hand side; the caller reads norms, once
/// an iteration.
///
/// Fields of level 0: b and x in float64; r, z, p, q and the correction d in the back end's working
/// precision. Coarser levels have an r and a z. K, g, D, w are the level's, in
/// diffusion/multigrid.h; red and black as there.
///
/// levels()              number of levels, >= 1.
/// true_residual()       x += d, d = 0, r = b - K x in float64, then rounded to the working
/// precision.
///                       Returns ||r||^2 of every right-hand side, taken in float64.
///                       Where x was zero, x may be left for true_norm() to complete, as long as r is of what it will be.
/// true_norm()           the same, but r need not be kept: true_residual() comes before anything that reads it.
///                       After a step it may finish x with one more half-sweep on r first.
/// finishing()           by how much ||r|| may exceed the tolerance for true_norm() to be tried: 1 where it does not
///                       finish x.
/// trusted_fall()        how far ||r|| may fall from one true_residual() to the next: 1e-5 where d is rounded to
///                       single precision and r not told.
/// smooth_restrict(l)    for l < levels() - 1: one red-black Gauss-Seidel sweep on K z = r from z =
/// 0, and the residual
///                       it leaves handed to r of level l + 1:
///                           red    z = r / D
///                           black  z = (r + sum g z) / D
///                           r_(l+1) = P^T (r - K z), which is zero in black cells and sum g z of
///                           black neighbours,
///                                     the change since the red half-sweep, in red ones
///                       z need not be kept.
/// prolong_smooth(l)     takes the correction from below and sweeps backwards, so that the V-cycle
/// is symmetric:
///                           red    z = r / D + P z_(l+1)       (on the last level: r / D)
///                           black  z = (r + sum g z) / D
///                           red    z = (r + sum g z) / D
///                       (what smooth_restrict left in black cells is overwritten here before
///                       anyone reads it). On level 0 also: rho_before = rho, rho = r . z.
/// apply_dot(restart)    beta = rho / rho_before (0 when restart, or where rho_before is not > 0);
///                       p = z + beta p, q = K p, gamma = p . q.
/// update_norm()         alpha = rho / gamma (0 where gamma is not > 0); d += alpha p,
///                       r -= alpha q.
///                       Returns ||r||^2 of every right-hand side: the only read of an iteration.
///
/// In single precision q = c p + sum g (p_i - p_j) with c = D - sum g, differences first: D p - sum g p loses as many
/// digits as K is ill-conditioned, and conjugate gradients then need half as many iterations again.
///
/// A back end may relax the red cells of x in float64 before it takes the residual, and then iterate on the black ones
/// alone: r stays zero in red cells under K with those eliminated (host/host_passes.h).
///
/// A back end may take gamma from z . K z and its recurrence (Chronopoulos & Gear 1989) and make p and q only in
/// update_norm. It may delay d += alpha p up to the next update_norm or true_residual, and may scale each
/// right-hand side by a constant of its own and K by another (||b|| = 1 and D <= 1 keep single precision
/// in its range), as long as the norms it returns are of the unscaled fields. The spans live until the
/// next pass.
template <class P>
concept DiffusionPasses = requires(P passes, int level, bool restart) {
  { passes.levels() } -> std::convertible_to<int>;
  { passes.true_residual() } -> std::convertible_to<std::span<const double>>;
  { passes.true_norm() } -> std::convertible_to<std::span<const double>>;
  { passes.finishing() } -> std::convertible_to<double>;
  { passes.trusted_fall() } -> std::convertible_to<double>;
  passes.smooth_restrict(level);
  passes.prolong_smooth(level);
  passes.apply_dot(restart);
  { passes.update_norm() } -> std::convertible_to<std::span<const double>>;
};

}  // namespace opaline::reconstruct::diffusion
