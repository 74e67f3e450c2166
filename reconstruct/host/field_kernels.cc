#include "reconstruct/host/field_kernels.h"

#include <cstdint>
#include <type_traits>

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
constexpr std::ptrdiff_t kAhead = 64;

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
    const auto left = [&](int cells)
                          HWY_ATTR { return hn::FirstN(d, static_cast<std::size_t>(cells)); };
    if (i + static_cast<int>(hn::Lanes(d)) >= nx) {
      all = later = hn::And(colour, left(nx - i));
      inner = hn::And(colour, left(nx - 1 - i));
    }
    if (i == 0) later = hn::AndNot(left(1), all);
  }
};

/// The lanes of some cells only: another thread may be writing the others.
HWY_INLINE V load(const double* at, M cells) { return hn::MaskedLoad(cells, D(), at); }

HWY_INLINE void store(V a, double* at, const Cells& cells) {
  hn::BlendedStore(a, cells.all, D(), at);
}

/// f(i, cells) for every register of a line.
template <class F>
HWY_INLINE void for_registers(int first, int nx, const F& f) {
  const auto step = static_cast<int>(hn::Lanes(D()));
  M colour = every_other(0, first);
  for (int i = 0; i < nx; i += step) {
    if (step == 1) colour = every_other(i, first);
    f(i, Cells(colour, i, nx));
  }
}

/// What joins every other cell of a line to its six neighbours; zero in the other cells.
struct Joins {
  V x_before, x_after, y_before, y_after, z_before, z_after;
};

HWY_INLINE Joins joins_at(const LineCoefficients& k, int i, const Cells& cells) {
  const D d;
  return {hn::MaskedLoad(cells.later, d, k.gx + i - 1),
          hn::MaskedLoad(cells.inner, d, k.gx + i),
          hn::MaskedLoad(cells.all, d, k.gy_before + i),
          hn::MaskedLoad(cells.all, d, k.gy_after + i),
          hn::MaskedLoad(cells.all, d, k.gz_before + i),
          hn::MaskedLoad(cells.all, d, k.gz_after + i)};
}

/// sum + sum g u over the neighbours, which have the other colour: nothing else counts.
HWY_INLINE V add_neighbours(V sum, const Joins& g, const NearLines& u, int i, const Cells& cells) {
  sum = hn::MulAdd(g.x_before, load(u.at + i - 1, cells.later), sum);
  sum = hn::MulAdd(g.x_after, load(u.at + i + 1, cells.inner), sum);
  sum = hn::MulAdd(g.y_before, load(u.y_before + i, cells.all), sum);
  sum = hn::MulAdd(g.y_after, load(u.y_after + i, cells.all), sum);
  sum = hn::MulAdd(g.z_before, load(u.z_before + i, cells.all), sum);
  return hn::MulAdd(g.z_after, load(u.z_after + i, cells.all), sum);
}

template <int N>
HWY_INLINE void relax_lines(
    const LineCoefficients& k, const FieldLines& f, double* const* to, int first, int nx) {
  for_registers(first, nx, [&](int i, const Cells& cells) HWY_ATTR {
    const Joins g = joins_at(k, i, cells);
    const V one = hn::Set(D(), 1.0);
    const V diagonal = hn::MaskedLoad(cells.all, D(), k.diagonal + i);
    const V inverse = hn::Div(one, hn::IfThenElse(cells.all, diagonal, one));
    for (int n = 0; n < N; ++n) {
      hwy::Prefetch(f.b[n].at + i + kAhead);
      hwy::Prefetch(f.x[n].z_after + i + kAhead);
      const V sum = add_neighbours(load(f.b[n].at + i, cells.all), g, f.x[n], i, cells);
      store(hn::Mul(sum, inverse), to[n] + i, cells);
    }
  });
}

/// kernel(lines, which of f they begin with, how many as a type): all at once, or one after another.
template <class F>
HWY_INLINE void for_lines(const FieldLines& f, const F& kernel) {
  if (f.count == kFieldsAtOnce) {
    kernel(f, 0, std::integral_constant<int, kFieldsAtOnce>());
    return;
  }
  for (int n = 0; n < f.count; ++n)
    kernel(FieldLines{{f.b[n]}, {f.x[n]}, 1}, n, std::integral_constant<int, 1>());
}

void relax(const LineCoefficients& k, const FieldLines& f, double* const* to, int first, int nx) {
  for_lines(f, [&](const FieldLines& some, int begin, auto count) HWY_ATTR {
    relax_lines<count>(k, some, to + begin, first, nx);
  });
}

template <class T>
HWY_INLINE ResidualLines<T> from(const ResidualLines<T>& to, int begin) {
  return {to.scale + begin, to.r + begin, to.sums + begin};
}

/// values(i, cells, a) puts b - K x of every field into a.
template <int N, class T, class F>
HWY_INLINE void keep_lines(const ResidualLines<T>& to, int first, int nx, const F& values) {
  V sum[N];
  for (int n = 0; n < N; ++n) sum[n] = hn::Zero(D());
  for_registers(first, nx, [&](int i, const Cells& cells) HWY_ATTR {
    V a[N];
    values(i, cells, a);
    for (int n = 0; n < N; ++n) {
      a[n] = hn::IfThenElseZero(cells.all, a[n]);
      sum[n] = hn::MulAdd(a[n], a[n], sum[n]);
      if (to.r[n] != nullptr)
        store_every_other(
            hn::Mul(a[n], hn::Set(D(), to.scale[n])), to.r[n] + i / 2, (first + i) % 2);
    }
  });
  for (int n = 0; n < N; ++n) to.sums[n] += hn::GetLane(hn::SumOfLanes(D(), sum[n]));
}

template <int N, class T>
void residual_lines(
    const LineCoefficients& k, const FieldLines& f, const ResidualLines<T>& to, int first, int nx) {
  keep_lines<N>(to, first, nx, [&](int i, const Cells& cells, V* a) HWY_ATTR {
    const Joins g = joins_at(k, i, cells);
    const V diagonal = hn::MaskedLoad(cells.all, D(), k.diagonal + i);
    for (int n = 0; n < N; ++n) {
      hwy::Prefetch(f.b[n].at + i + kAhead);
      hwy::Prefetch(f.x[n].z_after + i + kAhead);
      a[n] = load(f.b[n].at + i, cells.all);
      a[n] = hn::NegMulAdd(diagonal, load(f.x[n].at + i, cells.all), a[n]);
      a[n] = add_neighbours(a[n], g, f.x[n], i, cells);
    }
  });
}

HWY_INLINE V load_inverse(const double* at, M cells) { return hn::MaskedLoad(cells, D(), at); }
HWY_INLINE V load_inverse(const float* at, M cells) {
  const hn::Rebind<float, D> single;
  const auto kept = hn::DemoteTo(single, hn::IfThenElseZero(cells, hn::Set(D(), 1.0)));
  return hn::PromoteTo(D(), hn::MaskedLoad(hn::Ne(kept, hn::Zero(single)), single, at));
}

template <int N, class T>
void dark_residual_lines(const LineCoefficients& k,
                         const InverseLines<T>& inverse,
                         const FieldLines& f,
                         const ResidualLines<T>& to,
                         int first,
                         int nx) {
  keep_lines<N>(to, first, nx, [&](int i, const Cells& cells, V* a) HWY_ATTR {
    const V unit = hn::Set(D(), inverse.unit);
    const auto over = [&](V g, const T* at, M there) HWY_ATTR {
      return hn::Mul(hn::Mul(g, unit), load_inverse(at + i, there));
    };
    Joins g = joins_at(k, i, cells);
    g = {over(g.x_before, inverse.at - 1, cells.later),
         over(g.x_after, inverse.at + 1, cells.inner),
         over(g.y_before, inverse.y_before, cells.all),
         over(g.y_after, inverse.y_after, cells.all),
         over(g.z_before, inverse.z_before, cells.all),
         over(g.z_after, inverse.z_after, cells.all)};
    for (int n = 0; n < N; ++n) {
      hwy::Prefetch(f.b[n].z_after + i + kAhead);
      a[n] = add_neighbours(load(f.b[n].at + i, cells.all), g, f.b[n], i, cells);
    }
  });
}

template <class T>
void residual(
    const LineCoefficients& k, const FieldLines& f, const ResidualLines<T>& to, int first, int nx) {
  for_lines(f, [&](const FieldLines& some, int begin, auto count) HWY_ATTR {
    residual_lines<count>(k, some, from(to, begin), first, nx);
  });
}

template <class T>
void dark_residual(const LineCoefficients& k,
                   const InverseLines<T>& inverse,
                   const FieldLines& f,
                   const ResidualLines<T>& to,
                   int first,
                   int nx) {
  for_lines(f, [&](const FieldLines& some, int begin, auto count) HWY_ATTR {
    dark_residual_lines<count>(k, inverse, some, from(to, begin), first, nx);
  });
}

template <class T>
void add_from(double* x, const T* c, const T* more, double factor, int first, int nx) {
  for (int i = first; i < nx; i += 2) {
    double sum = c != nullptr ? static_cast<double>(c[i / 2]) : 0.0;
    if (more != nullptr) sum += static_cast<double>(more[i / 2]);
    x[i] += factor * sum;
  }
}

void add(double* x, const double* c, const double* more, double factor, int first, int nx) {
  add_from(x, c, more, factor, first, nx);
}

void add(double* x, const float* c, const float* more, double factor, int first, int nx) {
#if HWY_TARGET == HWY_SCALAR
  add_from(x, c, more, factor, first, nx);
#else
  const D d;
  const auto step = static_cast<int>(hn::Lanes(d));
  const V f = hn::Set(d, factor);
  int i = 0;
  for (; i + step <= nx; i += step) {
    hwy::Prefetch(x + i + kAhead);
    V sum = c != nullptr ? load_every_other(c + i / 2, first) : hn::Zero(d);
    if (more != nullptr) sum = hn::Add(sum, load_every_other(more + i / 2, first));
    hn::StoreU(hn::MulAdd(f, sum, hn::LoadU(d, x + i)), d, x + i);
  }
  add_from(x + i,
           c != nullptr ? c + i / 2 : nullptr,
           more != nullptr ? more + i / 2 : nullptr,
           factor,
           first,
           nx - i);
#endif
}

template <class T>
void to_fields_from(const T* lanes, T* fields, std::size_t stride, int width, int first, int nx) {
  for (std::ptrdiff_t i = first; i < nx; ++i)
    for (std::ptrdiff_t m = 0; m < width; ++m) fields[m * stride + i] = lanes[i * width + m];
}

void to_fields(const double* lanes, double* fields, std::size_t stride, int width, int nx) {
  to_fields_from(lanes, fields, stride, width, 0, nx);
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
void to_fields(const float* lanes, float* fields, std::size_t stride, int width, int nx) {
  to_fields_from(lanes, fields, stride, width, 0, nx);
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

void to_fields(const float* lanes, float* fields, std::size_t stride, int width, int nx) {
  const Four f;
  const int whole = width % 4 == 0 ? nx / 4 * 4 : 0;
  for (std::ptrdiff_t i = 0; i < whole; i += 4)
    for (std::ptrdiff_t m = 0; m < width; m += 4) {
      Square s;
      for (std::ptrdiff_t n = 0; n < 4; ++n) s.row[n] = hn::LoadU(f, lanes + (i + n) * width + m);
      s = transposed(s);
      for (std::ptrdiff_t n = 0; n < 4; ++n)
        hn::StoreU(s.row[n], f, fields + (m + n) * static_cast<std::ptrdiff_t>(stride) + i);
    }
  to_fields_from(lanes, fields, stride, width, whole, nx);
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
  return {relax, residual<float>, dark_residual<float>, add, to_fields, to_lanes};
}
FieldKernels<double> double_kernels() {
  return {relax, residual<double>, dark_residual<double>, add, to_fields, to_lanes};
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
