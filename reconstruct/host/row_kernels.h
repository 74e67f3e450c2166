#pragma once

#include <cstddef>
#include <cstdint>

namespace opaline::reconstruct::host {

/// What the sweeps do to one grid line along x. Fields hold `width` right-hand sides of a cell side
/// by side, then the next cell; a coefficient is one number a cell, shared by all of them. Fields
/// have a cell of zeros on either side of each row; rows outside the grid are rows of zeros.
///
/// K, g, D, w as in diffusion/multigrid.h. before and after: the neighbours at the lower and the
/// higher index.

/// u and the four rows around it, with the conductances of the faces: gx[i] joins cell i to i + 1.
struct Stencil {
  const float* u;
  const float* inner_before;
  const float* inner_after;
  const float* outer_before;
  const float* outer_after;
  const float* gx;
  const float* gi_before;
  const float* gi_after;
  const float* go_before;
  const float* go_after;
};

/// The transfer weights of one fine row: own = 1 - sum w. wx is zero where there is no aggregate
/// beside.
struct Weights {
  const float* own;
  const float* wx;
  const float* wi;
  const float* wo;
  int ratio_x;  ///< 1 or 2
  int coarse_nx;
};

/// kRestart: p = z. kKeep: p = z + beta p. kStore: the same after d = alpha p. kAdd: after d +=
/// alpha p.
enum class Direction : std::uint8_t { kRestart, kKeep, kStore, kAdd };

struct RowKernels {
  /// z = r / D in every other cell from `first`.
  void (*scale)(float* z, const float* r, const float* inverse, int first, int nx);
  /// z = r / D + P e in every other cell; above, inner, outer: the rows of e that the weights
  /// belong to.
  void (*prolong)(float* z,
                  const float* r,
                  const float* inverse,
                  const Weights& w,
                  const float* above,
                  const float* inner,
                  const float* outer,
                  int first,
                  int nx);
  /// z = (r + sum g z) / D in every other cell; s.u is z.
  void (*sweep)(
      float* z, const float* r, const float* inverse, const Stencil& s, int first, int nx);
  /// Adds P^T (sum g z) of every other cell to the three rows below.
  void (*restrict_row)(const Stencil& s,
                       const Weights& w,
                       float* below,
                       float* inner,
                       float* outer,
                       int first,
                       int nx);
  void (*direction)(Direction mode,
                    float* p,
                    const float* z,
                    float* d,
                    const float* alpha,
                    const float* beta,
                    int nx);
  /// out = z + beta p.
  void (*combine)(float* out, const float* z, const float* p, const float* beta, int nx);
  /// q = K u = c u_i + sum g (u_i - u), c = D - sum g; sum += u . q, one sum a right-hand side.
  void (*apply)(float* q, const float* sink, const Stencil& s, double* sum, int nx);
  /// r -= alpha q; sum += r . r.
  void (*update)(float* r, const float* q, const float* alpha, double* sum, int nx);
  /// sum += a . b.
  void (*dot)(const float* a, const float* b, double* sum, int nx);
};

/// Width 1, 4, 8 or 16, for the best instruction set of this processor.
RowKernels row_kernels(int width);

/// "AVX2", as Highway names it.
const char* instruction_set();

/// One line of one field in float64; rows of x outside the grid are null.
struct LineResidual {
  const double* b;
  const double* x;
  const double* inner_before;
  const double* inner_after;
  const double* outer_before;
  const double* outer_after;
  const double* diagonal;
  const double* gx;
  const double* gi_before;
  const double* gi_after;
  const double* go_before;
  const double* go_after;
};
/// r = b - K x along the line; returns r . r.
double line_residual(const LineResidual& line, double* r, int nx);

}  // namespace opaline::reconstruct::host
