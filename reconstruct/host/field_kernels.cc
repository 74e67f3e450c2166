#include "reconstruct/host/field_kernels.h"

#include <cstdint>

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

/// The lanes that hold every other cell from `first` on, lane 0 being cell i.
HWY_INLINE M every_other(int i, int first) {
  const hn::RebindToSigned<D> n;
  const auto parity = hn::And(hn::Iota(n, i), hn::Set(n, 1));
  return hn::RebindMask(D(), hn::Eq(parity, hn::Set(n, first)));
}

/// Packs the lanes first, first + 2, ...
HWY_INLINE void store_every_other(V a, double* at, int first) {
  HWY_ALIGN double lanes[hn::MaxLanes(D())];
  hn::Store(a, D(), lanes);
  for (std::size_t n = first; n < hn::Lanes(D()); n += 2) *at++ = lanes[n];
}

#if HWY_TARGET == HWY_SCALAR
HWY_INLINE void store_every_other(V a, float* at, int first) {
  if (first == 0) *at = static_cast<float>(hn::GetLane(a));
}
#else
using Pair =
    hn::Repartition<std::uint64_t, hn::Rebind<float, D> >;  // of float32, the first one low

HWY_INLINE void store_every_other(V a, float* at, int first) {
  const hn::Rebind<std::uint32_t, Pair> one;
  const auto pairs = hn::BitCast(Pair(), hn::DemoteTo(hn::Rebind<float, D>(), a));
  const auto packed = hn::TruncateTo(one, first == 0 ? pairs : hn::ShiftRight<32>(pairs));
  hn::StoreU(packed, one, reinterpret_cast<std::uint32_t*>(at));
}

/// The way back, with zeros in between.
HWY_INLINE V load_every_other(const float* at, int first) {
  const hn::Rebind<std::uint32_t, Pair> one;
  const auto pairs =
      hn::PromoteTo(Pair(), hn::LoadU(one, reinterpret_cast<const std::uint32_t*>(at)));
  const hn::Rebind<float, D> single;
  return hn::PromoteTo(D(), hn::BitCast(single, first == 0 ? pairs : hn::ShiftLeft<32>(pairs)));
}
#endif

/// Every other cell from `first`, as lanes of the vector at i; `later` have a cell before them, `inner` one after.
struct Cells {
  M all;
  M later;
  M inner;

  HWY_INLINE Cells(M colour, int i, int nx) : all(colour), later(colour), inner(colour) {
    const D d;
    const auto left = [&](int cells) { return hn::FirstN(d, static_cast<std::size_t>(cells)); };
    if (i + static_cast<int>(hn::Lanes(d)) >= nx) {
      all = later = hn::And(colour, left(nx - i));
      inner = hn::And(colour, left(nx - 1 - i));
    }
    if (i == 0) later = hn::AndNot(left(1), all);
  }
};

/// b - K x in those cells, whose neighbours have the other colour: nothing else is read.
HWY_INLINE V residual_at(const FieldLine& l, int i, const Cells& cells) {
  const D d;
  const auto at = [&](const double* row) { return hn::MaskedLoad(cells.all, d, row + i); };
  V a = at(l.b);
  if (l.x == nullptr) return a;
  a = hn::NegMulAdd(at(l.diagonal), at(l.x), a);
  a = hn::MulAdd(
      hn::MaskedLoad(cells.later, d, l.gx + i - 1), hn::MaskedLoad(cells.later, d, l.x + i - 1), a);
  a = hn::MulAdd(at(l.gx), hn::MaskedLoad(cells.inner, d, l.x + i + 1), a);
  if (l.y_before != nullptr) a = hn::MulAdd(at(l.gy_before), at(l.y_before), a);
  if (l.y_after != nullptr) a = hn::MulAdd(at(l.gy_after), at(l.y_after), a);
  if (l.z_before != nullptr) a = hn::MulAdd(at(l.gz_before), at(l.z_before), a);
  if (l.z_after != nullptr) a = hn::MulAdd(at(l.gz_after), at(l.z_after), a);
  return a;
}

HWY_INLINE void prefetch(const FieldLine& l, int i) {
  hwy::Prefetch(l.b + i + kAhead);
  if (l.z_after != nullptr) hwy::Prefetch(l.z_after + i + kAhead);
}

void relax(const FieldLine& line, double* x, int first, int nx) {
  const FieldLine l = line;  // not to be read again after every store
  const D d;
  const auto step = static_cast<int>(hn::Lanes(d));
  const V one = hn::Set(d, 1.0);
  M colour = every_other(0, first);
  for (int i = 0; i < nx; i += step) {
    prefetch(l, i);
    if (step == 1) colour = every_other(i, first);
    const Cells cells(colour, i, nx);
    const V diagonal = hn::MaskedLoad(cells.all, d, l.diagonal + i);
    const V change = hn::Div(residual_at(l, i, cells), hn::IfThenElse(cells.all, diagonal, one));
    const V before = l.x == nullptr ? hn::Zero(d) : hn::MaskedLoad(cells.all, d, l.x + i);
    hn::BlendedStore(hn::Add(before, change), cells.all, d, x + i);
  }
}

template <class T>
double residual(const FieldLine& line, double scale, T* r, int first, int nx) {
  const FieldLine l = line;  // not to be read again after every store
  const D d;
  const auto step = static_cast<int>(hn::Lanes(d));
  const V factor = hn::Set(d, scale);
  V sum = hn::Zero(d);
  M colour = every_other(0, first);
  for (int i = 0; i < nx; i += step) {
    prefetch(l, i);
    if (step == 1) colour = every_other(i, first);
    const V a = residual_at(l, i, Cells(colour, i, nx));
    sum = hn::MulAdd(a, a, sum);
    if (r != nullptr) store_every_other(hn::Mul(a, factor), r + i / 2, (first + i) % 2);
  }
  return hn::GetLane(hn::SumOfLanes(d, sum));
}

template <class T>
void add_from(double* x, const T* c, double factor, int first, int nx) {
  for (int i = first; i < nx; i += 2) x[i] += factor * static_cast<double>(c[i / 2]);
}

void add(double* x, const double* c, double factor, int first, int nx) {
  add_from(x, c, factor, first, nx);
}

void add(double* x, const float* c, double factor, int first, int nx) {
#if HWY_TARGET == HWY_SCALAR
  add_from(x, c, factor, first, nx);
#else
  const D d;
  const auto step = static_cast<int>(hn::Lanes(d));
  const V f = hn::Set(d, factor);
  int i = 0;
  for (; i + step <= nx; i += step) {
    hwy::Prefetch(x + i + kAhead);
    const V before = hn::LoadU(d, x + i);
    hn::StoreU(hn::MulAdd(f, load_every_other(c + i / 2, first), before), d, x + i);
  }
  add_from(x + i, c + i / 2, factor, first, nx - i);
#endif
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

FieldKernels<float> single_kernels() { return {relax, residual<float>, add, to_fields, to_lanes}; }
FieldKernels<double> double_kernels() {
  return {relax, residual<double>, add, to_fields, to_lanes};
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
