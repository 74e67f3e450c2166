#include "reconstruct/host/row_kernels.h"

// Only instruction sets of fixed width: the right-hand sides of a cell are arrays of registers.
#define HWY_DISABLED_TARGETS (HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128 | HWY_RVV | HWY_SSSE3)
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "reconstruct/host/row_kernels.cc"
#include <hwy/cache_control.h>
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace opaline::reconstruct::host::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

/// Cells between what is read and what is asked for: the processor does not foresee every other cell of a row.
constexpr std::ptrdiff_t kAhead = 16;

/// The right-hand sides of one cell: W floats in kCount registers.
template <int W>
struct Lanes {
  using D = hn::CappedTag<float, W>;
  using V = hn::Vec<D>;
  static constexpr std::ptrdiff_t kLanes = static_cast<std::ptrdiff_t>(hn::MaxLanes(D()));
  static constexpr int kCount = W / kLanes;

  V v[kCount];

  static HWY_INLINE Lanes load(const float* at) {
    Lanes a;
    for (int n = 0; n < kCount; ++n) a.v[n] = hn::LoadU(D(), at + n * kLanes);
    return a;
  }
  static HWY_INLINE Lanes zero() {
    Lanes a;
    for (int n = 0; n < kCount; ++n) a.v[n] = hn::Zero(D());
    return a;
  }
  HWY_INLINE void store(float* at) const {
    for (int n = 0; n < kCount; ++n) hn::StoreU(v[n], D(), at + n * kLanes);
  }
  /// += factor * (what lies at `at`), one factor for all lanes.
  HWY_INLINE void add(float factor, const float* at) {
    const V f = hn::Set(D(), factor);
    for (int n = 0; n < kCount; ++n) v[n] = hn::MulAdd(f, hn::LoadU(D(), at + n * kLanes), v[n]);
  }
  HWY_INLINE void scale(float factor) {
    const V f = hn::Set(D(), factor);
    for (int n = 0; n < kCount; ++n) v[n] = hn::Mul(v[n], f);
  }
  /// += factor * (u - what lies at `at`).
  HWY_INLINE void add_difference(float factor, const Lanes& u, const float* at) {
    const V f = hn::Set(D(), factor);
    for (int n = 0; n < kCount; ++n)
      v[n] = hn::MulAdd(f, hn::Sub(u.v[n], hn::LoadU(D(), at + n * kLanes)), v[n]);
  }
  /// += a * b, lane by lane.
  HWY_INLINE void add(const Lanes& a, const Lanes& b) {
    for (int n = 0; n < kCount; ++n) v[n] = hn::MulAdd(a.v[n], b.v[n], v[n]);
  }
  /// -= a * b, lane by lane.
  HWY_INLINE void subtract(const Lanes& a, const Lanes& b) {
    for (int n = 0; n < kCount; ++n) v[n] = hn::NegMulAdd(a.v[n], b.v[n], v[n]);
  }
  /// factor * this, added to what lies at `at`.
  HWY_INLINE void add_scaled_to(float* at, float factor) const {
    const V f = hn::Set(D(), factor);
    for (int n = 0; n < kCount; ++n)
      hn::StoreU(hn::MulAdd(f, v[n], hn::LoadU(D(), at + n * kLanes)), D(), at + n * kLanes);
  }
  HWY_INLINE void add_to(double* sum) const {
    float values[W];
    store(values);
    for (int m = 0; m < W; ++m) sum[m] += static_cast<double>(values[m]);
  }
};

/// a += sum g u over the six neighbours of cell i.
template <int W>
HWY_INLINE void add_neighbours(Lanes<W>& a, const Stencil& s, std::ptrdiff_t i) {
  const std::ptrdiff_t at = i * W;
  a.add(s.gx[i - 1], s.u + at - W);
  a.add(s.gx[i], s.u + at + W);
  a.add(s.gi_before[i], s.inner_before + at);
  a.add(s.gi_after[i], s.inner_after + at);
  a.add(s.go_before[i], s.outer_before + at);
  a.add(s.go_after[i], s.outer_after + at);
}

/// a += sum g (u_i - u) over the six neighbours of cell i. Subtracting first keeps single precision exact where u is
/// smooth; D u - sum g u would lose as many digits as K is ill-conditioned.
template <int W>
HWY_INLINE void add_flows(Lanes<W>& a, const Lanes<W>& u, const Stencil& s, std::ptrdiff_t i) {
  const std::ptrdiff_t at = i * W;
  a.add_difference(s.gx[i - 1], u, s.u + at - W);
  a.add_difference(s.gx[i], u, s.u + at + W);
  a.add_difference(s.gi_before[i], u, s.inner_before + at);
  a.add_difference(s.gi_after[i], u, s.inner_after + at);
  a.add_difference(s.go_before[i], u, s.outer_before + at);
  a.add_difference(s.go_after[i], u, s.outer_after + at);
}

template <int W>
struct Kernels {
  using L = Lanes<W>;

  static void scale(float* z, const float* r, const float* inverse, int first, int nx) {
    for (std::ptrdiff_t i = first; i < nx; i += 2) {
      hwy::Prefetch(r + (i + kAhead) * W);
      L a = L::load(r + i * W);
      a.scale(inverse[i]);
      a.store(z + i * W);
    }
  }

  static void prolong(float* z,
                      const float* r,
                      const float* inverse,
                      const Weights& w,
                      const float* above,
                      const float* inner,
                      const float* outer,
                      int first,
                      int nx) {
    for (std::ptrdiff_t i = first; i < nx; i += 2) {
      const std::ptrdiff_t up = i / w.ratio_x;
      const std::ptrdiff_t beside = i % 2 == 1 ? up + 1 : up - 1;
      hwy::Prefetch(r + (i + kAhead) * W);
      L a = L::load(r + i * W);
      a.scale(inverse[i]);
      a.add(w.own[i], above + up * W);
      a.add(w.wx[i], above + beside * W);
      a.add(w.wi[i], inner + up * W);
      a.add(w.wo[i], outer + up * W);
      a.store(z + i * W);
    }
  }

  static void sweep(
      float* z, const float* r, const float* inverse, const Stencil& s, int first, int nx) {
    for (std::ptrdiff_t i = first; i < nx; i += 2) {
      hwy::Prefetch(r + (i + kAhead) * W);
      L a = L::load(r + i * W);
      add_neighbours<W>(a, s, i);
      a.scale(inverse[i]);
      a.store(z + i * W);
    }
  }

  static void restrict_row(const Stencil& s,
                           const Weights& w,
                           float* below,
                           float* inner,
                           float* outer,
                           int first,
                           int nx) {
    for (std::ptrdiff_t i = first; i < nx; i += 2) {
      const std::ptrdiff_t down = i / w.ratio_x;
      const std::ptrdiff_t beside = i % 2 == 1 ? HWY_MIN(down + 1, std::ptrdiff_t{w.coarse_nx} - 1)
                                               : HWY_MAX(down - 1, std::ptrdiff_t{0});
      L a = L::zero();
      add_neighbours<W>(a, s, i);
      a.add_scaled_to(below + down * W, w.own[i]);
      a.add_scaled_to(below + beside * W, w.wx[i]);
      a.add_scaled_to(inner + down * W, w.wi[i]);
      a.add_scaled_to(outer + down * W, w.wo[i]);
    }
  }

  static void combine(float* out, const float* z, const float* p, const float* beta, int nx) {
    const L b = L::load(beta);
    for (std::ptrdiff_t i = 0; i < nx; ++i) {
      L a = L::load(z + i * W);
      a.add(b, L::load(p + i * W));
      a.store(out + i * W);
    }
  }

  static void direction(Direction mode,
                        float* p,
                        const float* z,
                        float* d,
                        const float* alpha,
                        const float* beta,
                        int nx) {
    const L step = L::load(alpha);
    if (mode == Direction::kRestart)
      for (std::ptrdiff_t i = 0; i < nx; ++i) L::load(z + i * W).store(p + i * W);
    if (mode == Direction::kStore || mode == Direction::kAdd)
      for (std::ptrdiff_t i = 0; i < nx; ++i) {
        L sum = mode == Direction::kAdd ? L::load(d + i * W) : L::zero();
        sum.add(step, L::load(p + i * W));
        sum.store(d + i * W);
      }
    if (mode != Direction::kRestart) combine(p, z, p, beta, nx);
  }

  static void apply(float* q, const float* sink, const Stencil& s, double* sum, int nx) {
    L total = L::zero();
    for (std::ptrdiff_t i = 0; i < nx; ++i) {
      const L u = L::load(s.u + i * W);
      L a = u;
      a.scale(sink[i]);
      add_flows<W>(a, u, s, i);
      a.store(q + i * W);
      total.add(u, a);
    }
    total.add_to(sum);
  }

  static void update(float* r, const float* q, const float* alpha, double* sum, int nx) {
    const L step = L::load(alpha);
    L total = L::zero();
    for (std::ptrdiff_t i = 0; i < nx; ++i) {
      L a = L::load(r + i * W);
      a.subtract(step, L::load(q + i * W));
      a.store(r + i * W);
      total.add(a, a);
    }
    total.add_to(sum);
  }

  static void dot(const float* a, const float* b, double* sum, int nx) {
    L total = L::zero();
    for (std::ptrdiff_t i = 0; i < nx; ++i) total.add(L::load(a + i * W), L::load(b + i * W));
    total.add_to(sum);
  }

  static RowKernels table() {
    return {scale, prolong, sweep, restrict_row, direction, combine, apply, update, dot};
  }
};

RowKernels table(int width) {
  switch (width) {
    case 1:
      return Kernels<1>::table();
    case 4:
      return Kernels<4>::table();
    case 8:
      return Kernels<8>::table();
    default:
      return Kernels<16>::table();
  }
}

const char* target_name() { return hwy::TargetName(HWY_TARGET); }

/// Cells i ... i + Lanes(d) of a residual, all of which have neighbours along x.
template <class D>
HWY_INLINE hn::Vec<D> store_residual(D d, const LineResidual& l, int i, double* r) {
  auto a =
      hn::NegMulAdd(hn::LoadU(d, l.diagonal + i), hn::LoadU(d, l.x + i), hn::LoadU(d, l.b + i));
  a = hn::MulAdd(hn::LoadU(d, l.gx + i - 1), hn::LoadU(d, l.x + i - 1), a);
  a = hn::MulAdd(hn::LoadU(d, l.gx + i), hn::LoadU(d, l.x + i + 1), a);
  if (l.inner_before != nullptr)
    a = hn::MulAdd(hn::LoadU(d, l.gi_before + i), hn::LoadU(d, l.inner_before + i), a);
  if (l.inner_after != nullptr)
    a = hn::MulAdd(hn::LoadU(d, l.gi_after + i), hn::LoadU(d, l.inner_after + i), a);
  if (l.outer_before != nullptr)
    a = hn::MulAdd(hn::LoadU(d, l.go_before + i), hn::LoadU(d, l.outer_before + i), a);
  if (l.outer_after != nullptr)
    a = hn::MulAdd(hn::LoadU(d, l.go_after + i), hn::LoadU(d, l.outer_after + i), a);
  hn::StoreU(a, d, r + i);
  return a;
}

double residual_at_end(const LineResidual& l, int i, int nx) {
  double a = l.b[i] - l.diagonal[i] * l.x[i];
  if (i > 0) a += l.gx[i - 1] * l.x[i - 1];
  if (i + 1 < nx) a += l.gx[i] * l.x[i + 1];
  if (l.inner_before != nullptr) a += l.gi_before[i] * l.inner_before[i];
  if (l.inner_after != nullptr) a += l.gi_after[i] * l.inner_after[i];
  if (l.outer_before != nullptr) a += l.go_before[i] * l.outer_before[i];
  if (l.outer_after != nullptr) a += l.go_after[i] * l.outer_after[i];
  return a;
}

double line(const LineResidual& l, double* r, int nx) {
  const hn::ScalableTag<double> d;
  const auto step = static_cast<int>(hn::Lanes(d));
  r[0] = residual_at_end(l, 0, nx);
  double ends = r[0] * r[0];
  auto sum = hn::Zero(d);
  int i = 1;
  for (; i + step < nx; i += step) {
    const auto a = store_residual(d, l, i, r);
    sum = hn::MulAdd(a, a, sum);
  }
  for (; i < nx; ++i) {
    r[i] = residual_at_end(l, i, nx);
    ends += r[i] * r[i];
  }
  return ends + hn::GetLane(hn::SumOfLanes(d, sum));
}

}  // namespace opaline::reconstruct::host::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace opaline::reconstruct::host {
HWY_EXPORT(table);
HWY_EXPORT(target_name);
HWY_EXPORT(line);

RowKernels row_kernels(int width) { return HWY_DYNAMIC_DISPATCH(table)(width); }
const char* instruction_set() { return HWY_DYNAMIC_DISPATCH(target_name)(); }
double line_residual(const LineResidual& l, double* r, int nx) {
  return HWY_DYNAMIC_DISPATCH(line)(l, r, nx);
}

}  // namespace opaline::reconstruct::host
#endif
