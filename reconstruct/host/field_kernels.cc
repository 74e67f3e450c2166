#include "reconstruct/host/field_kernels.h"

#define HWY_DISABLED_TARGETS (HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128 | HWY_RVV | HWY_SSSE3)
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "reconstruct/host/field_kernels.cc"
#include <hwy/cache_control.h>
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace opaline::reconstruct::host::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

/// Numbers between what is read and what is asked for: lines follow each other.
constexpr std::ptrdiff_t kAhead = 256;

using D = hn::ScalableTag<double>;
using V = hn::Vec<D>;
using M = hn::Mask<D>;

HWY_INLINE void store(V a, double* at) { hn::StoreU(a, D(), at); }
HWY_INLINE void store(V a, float* at) {
  const hn::Rebind<float, D> f;
  hn::StoreU(hn::DemoteTo(f, a), f, at);
}
HWY_INLINE V load(const double* at) { return hn::LoadU(D(), at); }
HWY_INLINE V load(const float* at) {
  return hn::PromoteTo(D(), hn::LoadU(hn::Rebind<float, D>(), at));
}

/// b - K x in the cells of the mask; those of `later` have a cell before them, those of `inner` one after.
HWY_INLINE V residual_at(const FieldLine& l, int i, M cells, M later, M inner) {
  const D d;
  const auto at = [&](const double* row) { return hn::MaskedLoad(cells, d, row + i); };
  V a = at(l.b);
  if (l.x == nullptr) return a;
  a = hn::NegMulAdd(at(l.diagonal), at(l.x), a);
  a = hn::MulAdd(hn::MaskedLoad(later, d, l.gx + i - 1), hn::MaskedLoad(later, d, l.x + i - 1), a);
  a = hn::MulAdd(at(l.gx), hn::MaskedLoad(inner, d, l.x + i + 1), a);
  if (l.y_before != nullptr) a = hn::MulAdd(at(l.gy_before), at(l.y_before), a);
  if (l.y_after != nullptr) a = hn::MulAdd(at(l.gy_after), at(l.y_after), a);
  if (l.z_before != nullptr) a = hn::MulAdd(at(l.gz_before), at(l.z_before), a);
  if (l.z_after != nullptr) a = hn::MulAdd(at(l.gz_after), at(l.z_after), a);
  return a;
}

template <class T>
double residual(const FieldLine& line, double scale, T* r, int nx) {
  const FieldLine l = line;  // not to be read again after every store
  const D d;
  const auto step = static_cast<int>(hn::Lanes(d));
  const V factor = hn::Set(d, scale);
  V sum = hn::Zero(d);
  const M all = hn::FirstN(d, static_cast<std::size_t>(step));
  const M first = hn::FirstN(d, 1);
  for (int i = 0; i < nx; i += step) {
    hwy::Prefetch(l.b + i + kAhead);
    if (l.z_after != nullptr) hwy::Prefetch(l.z_after + i + kAhead);
    const bool whole = i + step < nx;
    const M cells = whole ? all : hn::FirstN(d, static_cast<std::size_t>(nx - i));
    const M inner = whole ? all : hn::FirstN(d, static_cast<std::size_t>(nx - 1 - i));
    const M later = i == 0 ? hn::AndNot(first, cells) : cells;
    const V a = residual_at(l, i, cells, later, inner);
    sum = hn::MulAdd(a, a, sum);
    if (r != nullptr) store(hn::Mul(a, factor), r + i);
  }
  return hn::GetLane(hn::SumOfLanes(d, sum));
}

/// x = factor c, on top of what x was where it is kept.
template <bool kKept, class T>
void move(double* x, const T* c, double factor, int nx) {
  const D d;
  const auto step = static_cast<int>(hn::Lanes(d));
  const V f = hn::Set(d, factor);
  int i = 0;
  for (; i + step <= nx; i += step) {
    if constexpr (kKept) hwy::Prefetch(x + i + kAhead);
    const V before = kKept ? hn::LoadU(d, x + i) : hn::Zero(d);
    hn::StoreU(hn::MulAdd(f, load(c + i), before), d, x + i);
  }
  for (; i < nx; ++i) x[i] = (kKept ? x[i] : 0.0) + factor * static_cast<double>(c[i]);
}

template <class T>
void to_fields_from(const T* d,
                    const T* p,
                    const T* step,
                    T* fields,
                    std::size_t stride,
                    int width,
                    int first,
                    int nx) {
  for (std::ptrdiff_t i = first; i < nx; ++i)
    for (std::ptrdiff_t m = 0; m < width; ++m)
      fields[m * stride + i] =
          (d != nullptr ? d[i * width + m] : T{0}) + step[m] * p[i * width + m];
}

void to_fields(const double* d,
               const double* p,
               const double* step,
               double* fields,
               std::size_t stride,
               int width,
               int nx) {
  to_fields_from(d, p, step, fields, stride, width, 0, nx);
}

template <class T>
void to_lanes_from(const T* fields, std::size_t stride, T* lanes, int width, int first, int nx) {
  for (std::ptrdiff_t i = first; i < nx; ++i)
    for (std::ptrdiff_t m = 0; m < width; ++m) lanes[i * width + m] = fields[m * stride + i];
}

void to_lanes(const double* fields, std::size_t stride, double* lanes, int width, int nx) {
  to_lanes_from(fields, stride, lanes, width, 0, nx);
}

#if HWY_TARGET == HWY_SCALAR
void to_fields(const float* d,
               const float* p,
               const float* step,
               float* fields,
               std::size_t stride,
               int width,
               int nx) {
  to_fields_from(d, p, step, fields, stride, width, 0, nx);
}

void to_lanes(const float* fields, std::size_t stride, float* lanes, int width, int nx) {
  to_lanes_from(fields, stride, lanes, width, 0, nx);
}
#else
using Four = hn::FixedTag<float, 4>;
struct Square {
  hn::Vec<Four> row[4];
};

HWY_INLINE Square transposed(const Square& s) {
  const Four f;
  const auto low01 = hn::InterleaveLower(f, s.row[0], s.row[1]);
  const auto low23 = hn::InterleaveLower(f, s.row[2], s.row[3]);
  const auto high01 = hn::InterleaveUpper(f, s.row[0], s.row[1]);
  const auto high23 = hn::InterleaveUpper(f, s.row[2], s.row[3]);
  return {{hn::ConcatLowerLower(f, low23, low01),
           hn::ConcatUpperUpper(f, low23, low01),
           hn::ConcatLowerLower(f, high23, high01),
           hn::ConcatUpperUpper(f, high23, high01)}};
}

void to_fields(const float* d,
               const float* p,
               const float* step,
               float* fields,
               std::size_t stride,
               int width,
               int nx) {
  const Four f;
  const int whole = width % 4 == 0 ? nx / 4 * 4 : 0;
  for (std::ptrdiff_t i = 0; i < whole; i += 4)
    for (std::ptrdiff_t m = 0; m < width; m += 4) {
      const auto length = hn::LoadU(f, step + m);
      Square s;
      for (std::ptrdiff_t n = 0; n < 4; ++n) {
        const std::ptrdiff_t at = (i + n) * width + m;
        const auto sum = d != nullptr ? hn::LoadU(f, d + at) : hn::Zero(f);
        s.row[n] = hn::MulAdd(length, hn::LoadU(f, p + at), sum);
      }
      s = transposed(s);
      for (std::ptrdiff_t n = 0; n < 4; ++n)
        hn::StoreU(s.row[n], f, fields + (m + n) * static_cast<std::ptrdiff_t>(stride) + i);
    }
  to_fields_from(d, p, step, fields, stride, width, whole, nx);
}

void to_lanes(const float* fields, std::size_t stride, float* lanes, int width, int nx) {
  const Four f;
  const int whole = width % 4 == 0 ? nx / 4 * 4 : 0;
  for (std::ptrdiff_t i = 0; i < whole; i += 4)
    for (std::ptrdiff_t m = 0; m < width; m += 4) {
      Square s;
      for (std::ptrdiff_t n = 0; n < 4; ++n)
        s.row[n] = hn::LoadU(f, fields + (m + n) * static_cast<std::ptrdiff_t>(stride) + i);
      s = transposed(s);
      for (std::ptrdiff_t n = 0; n < 4; ++n) hn::StoreU(s.row[n], f, lanes + (i + n) * width + m);
    }
  to_lanes_from(fields, stride, lanes, width, whole, nx);
}
#endif

FieldKernels<float> single_kernels() {
  return {residual<float>, move<true, float>, move<false, float>, to_fields, to_lanes};
}
FieldKernels<double> double_kernels() {
  return {residual<double>, move<true, double>, move<false, double>, to_fields, to_lanes};
}

}  // namespace opaline::reconstruct::host::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace opaline::reconstruct::host {
HWY_EXPORT(single_kernels);
HWY_EXPORT(double_kernels);

template <>
FieldKernels<float> field_kernels() {
  return HWY_DYNAMIC_DISPATCH(single_kernels)();
}
template <>
FieldKernels<double> field_kernels() {
  return HWY_DYNAMIC_DISPATCH(double_kernels)();
}

}  // namespace opaline::reconstruct::host
#endif
