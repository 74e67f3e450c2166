#pragma once

#include <cstddef>
#include <cstdint>

namespace opaline::reconstruct::host {

/// IEEE 754 binary16 as it lies in memory. Numbers that are too large for it are stored as +-65504.
struct Half {
  std::uint16_t bits = 0;
};

/// What the sweeps do to one grid line along x. Fields hold `width` right-hand sides of a cell side
/// by side, then the next cell; a coefficient is one number a cell, shared by all of them. Fields
/// have a cell on either side of each row that may be read; rows outside the grid are rows of zeros.
/// Every other cell: first, first + 2, ...; packed, they lie side by side, cell i at i / 2.
///
/// K, g, D, w as in diffusion/multigrid.h. before and after: the neighbours at the lower and the
/// higher index. T computes; S is how z lies in memory between two passes.

/// u and the four rows around it, with the conductances of the faces: gx[i] joins cell i to i + 1.
template <class T>
struct Stencil {
  const T* u;
  const T* inner_before;
  const T* inner_after;
  const T* outer_before;
  const T* outer_after;
  const T* gx;
  const T* gi_before;
  const T* gi_after;
  const T* go_before;
  const T* go_after;
};

/// The six neighbours of every other cell, which are of the other colour and packed: those of cell
/// first + 2 m at m.
template <class T>
struct PackedStencil {
  const T* x_before;
  const T* x_after;
  const T* inner_before;
  const T* inner_after;
  const T* outer_before;
  const T* outer_after;
  const T* gx;
  const T* gi_before;
  const T* gi_after;
  const T* go_before;
  const T* go_after;
};

/// The transfer weights of one fine row: own = 1 - sum w. wx is zero where there is no aggregate
/// beside.
template <class T>
struct Weights {
  const T* own;
  const T* wx;
  const T* wi;
  const T* wo;
  int ratio_x;  ///< 1 or 2
};

/// The three rows of the next level that a fine row's weights belong to.
template <class T>
struct CoarseRows {
  T* own;
  T* inner;
  T* outer;
};

/// The factors of a step, one a right-hand side.
template <class T>
struct StepFactors {
  const T* z;       ///< alpha
  const T* before;  ///< alpha beta / the alpha before
  const T* growth;  ///< a power of two: d is in units of s / growth
  const T* shrink;  ///< 1 / growth
};

template <class T, class S>
struct RowKernels {
  /// z = r / D in every other cell; zero where r is null.
  void (*scale)(T* z, const T* r, bool packed, const T* inverse, int first, int nx);
  /// z = r / D + P e in every other cell; a null r is zero.
  void (*prolong)(T* z,
                  const T* r,
                  const T* inverse,
                  const Weights<T>& w,
                  const CoarseRows<const S>& e,
                  int first,
                  int nx);
  /// z = (r + sum g z) / D in every other cell; s.u is z, a null r is zero.
  void (*sweep)(
      T* z, const T* r, bool packed, const T* inverse, const Stencil<T>& s, int first, int nx);
  /// Adds P^T (sum g z) of every other cell to the rows below.
  void (*restrict_row)(
      const Stencil<T>& s, const Weights<T>& w, const CoarseRows<T>& below, int first, int nx);
  /// out = z.
  void (*copy)(S* out, const T* z, int nx);
  /// out = z, rho += z . r and energy += c z . z in every other cell, out and r packed.
  void (*emit)(S* out,
               const T* z,
               const T* r,
               const T* sink,
               double* rho,
               double* energy,
               int first,
               int nx);
  /// sum += c z . z + sum g (z - z_near)^2 over every other cell, z = (sum g z_near) / D; s.u is z_near.
  void (*energy)(
      const T* sink, const T* inverse, const Stencil<T>& s, double* sum, int first, int nx);
  /// s = alpha z + alpha beta / (alpha before) s_before, then d = d_before + s as it is rounded, and s = d - d_before,
  /// which is what d really moved by. A null s_before or d_before is zero; a null d is not kept.
  void (*step)(const StepFactors<T>& factors,
               const S* z,
               const T* s_before,
               const T* d_before,
               T* s,
               T* d,
               int nx);
  /// In every other cell t = (sum g s) / D, and what t lacks by rounding: t[2 m] and t[2 m + 1] are
  /// t and t' = (sum g (s - t) - c t) / D, so that K (s, t + t') vanishes there. c = D - sum g.
  void (*relax)(
      T* t, const T* sink, const T* inverse, const PackedStencil<T>& s, int first, int nx);
  /// r = factor (r - q) in every other cell, q = c s + sum g (s - t - t') with t as relax leaves
  /// it; r and s packed; sum += r . r, one sum a right-hand side.
  void (*update)(T* r,
                 const T* s,
                 const T* sink,
                 const PackedStencil<T>& t,
                 const T* factor,
                 double* sum,
                 int first,
                 int nx);
  /// d = d_before + shrink r / D, of every other cell; d and r packed. A null d_before is zero.
  void (*finish)(
      T* d, const T* d_before, const T* r, const T* inverse, const T* shrink, int first, int nx);
};

/// Width 1, 4, 8 or 16, for the best instruction set of this processor. T and S: float and float,
/// float and Half, double and double.
template <class T, class S>
RowKernels<T, S> row_kernels(int width);

/// "AVX2", as Highway names it.
const char* instruction_set();

}  // namespace opaline::reconstruct::host
