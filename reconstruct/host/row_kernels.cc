#include "reconstruct/host/row_kernels.h"

// Only instruction sets of fixed width: the right-hand sides of a cell are arrays of registers.
#define HWY_DISABLED_TARGETS (HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128 | HWY_RVV | HWY_SSSE3)
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "reconstruct/host/row_kernels.cc"
#include <hwy/cache_control.h>
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include "reconstruct/host/lanes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace opaline::reconstruct::host::HWY_NAMESPACE {

/// Cells between what is read and what is asked for: the processor does not foresee every other cell of a row.
constexpr std::ptrdiff_t kAhead = 8;

/// a += sum g u over the six neighbours of cell i.
template <int W, class T>
HWY_INLINE void add_neighbours(Lanes<T, W>& a, const Stencil<T>& s, std::ptrdiff_t i) {
  using L = Lanes<T, W>;
  const std::ptrdiff_t at = i * W;
  a.add(s.gx[i - 1], L::load(s.u + at - W));
  a.add(s.gx[i], L::load(s.u + at + W));
  a.add(s.gi_before[i], L::load(s.inner_before + at));
  a.add(s.gi_after[i], L::load(s.inner_after + at));
  a.add(s.go_before[i], L::load(s.outer_before + at));
  a.add(s.go_after[i], L::load(s.outer_after + at));
}

/// f(factor, where the neighbour lies) for the six neighbours of cell i, `size` numbers a cell.
template <class T, class F>
HWY_INLINE void for_neighbours(const PackedStencil<T>& s, std::ptrdiff_t i, int size, F f) {
  const std::ptrdiff_t at = i / 2 * size;
  f(s.gx[i - 1], s.x_before + at);
  f(s.gx[i], s.x_after + at);
  f(s.gi_before[i], s.inner_before + at);
  f(s.gi_after[i], s.inner_after + at);
  f(s.go_before[i], s.outer_before + at);
  f(s.go_after[i], s.outer_after + at);
}

template <class T, class S, int W>
struct Kernels {
  using L = Lanes<T, W>;

  /// Both colours: the wave comes for the other one a plane later.
  static HWY_INLINE void prefetch_pair(const T* at) {
    hwy::Prefetch(at);
    hwy::Prefetch(at + W);
  }

  /// Cells of the right-hand side: all of them, or every other one side by side, or none at all.
  struct Right {
    const T* r;
    int shift;

    HWY_INLINE L at(std::ptrdiff_t i) const { return L::load(r + (i >> shift) * W); }
    HWY_INLINE void ask_for(std::ptrdiff_t i) const {
      hwy::Prefetch(r + ((i >> shift) + kAhead) * W);
      if (shift == 0) hwy::Prefetch(r + (i + kAhead + 1) * W);
    }
  };

  static void scale(T* z, const T* r, bool packed, const T* inverse, int first, int nx) {
    if (r == nullptr) {
      for (std::ptrdiff_t i = first; i < nx; i += 2) L::zero().store(z + i * W);
      return;
    }
    const Right right{r, packed ? 1 : 0};
    for (std::ptrdiff_t i = first; i < nx; i += 2) {
      right.ask_for(i);
      L a = right.at(i);
      a.scale(inverse[i]);
      a.store(z + i * W);
    }
  }

  static void prolong(T* z,
                      const T* r,
                      const T* inverse,
                      const Weights<T>& weights,
                      const CoarseRows<const S>& coarse,
                      int first,
                      int nx) {
    const Weights<T> w = weights;
    const CoarseRows<const S> e = coarse;
    for (std::ptrdiff_t i = first; i < nx; i += 2) {
      const std::ptrdiff_t up = i / w.ratio_x;
      const std::ptrdiff_t beside = i % 2 == 1 ? up + 1 : up - 1;
      L a = L::zero();
      if (r != nullptr) {
        prefetch_pair(r + (i + kAhead) * W);
        a = L::load(r + i * W);
        a.scale(inverse[i]);
      }
      a.add(w.own[i], L::load(e.own + up * W));
      a.add(w.wx[i], L::load(e.own + beside * W));
      a.add(w.wi[i], L::load(e.inner + up * W));
      a.add(w.wo[i], L::load(e.outer + up * W));
      a.store(z + i * W);
    }
  }

  static void sweep(
      T* z, const T* r, bool packed, const T* inverse, const Stencil<T>& rows, int first, int nx) {
    const Stencil<T> s = rows;  // not to be read again after every store
    const Right right{r, packed ? 1 : 0};
    for (std::ptrdiff_t i = first; i < nx; i += 2) {
      L a = r != nullptr ? right.at(i) : L::zero();
      add_neighbours<W>(a, s, i);
      a.scale(inverse[i]);
      a.store(z + i * W);
    }
  }

  static void restrict_row(const Stencil<T>& rows,
                           const Weights<T>& weights,
                           const CoarseRows<T>& coarse,
                           int first,
                           int nx) {
    const Weights<T> w = weights;
    const CoarseRows<T> below = coarse;
    const Stencil<T> s = rows;  // not to be read again after every store
    for (std::ptrdiff_t i = first; i < nx; i += 2) {
      const std::ptrdiff_t down = i / w.ratio_x;
      const std::ptrdiff_t beside = i % 2 == 1 ? down + 1 : down - 1;
      L a = L::zero();
      add_neighbours<W>(a, s, i);
      a.add_scaled_to(below.own + down * W, w.own[i]);
      a.add_scaled_to(below.own + beside * W, w.wx[i]);
      a.add_scaled_to(below.inner + down * W, w.wi[i]);
      a.add_scaled_to(below.outer + down * W, w.wo[i]);
    }
  }

  static void copy(S* out, const T* z, int nx) {
    for (std::ptrdiff_t i = 0; i < nx; ++i) L::load(z + i * W).store(out + i * W);
  }

  static void emit(S* out,
                   const T* z,
                   const T* r,
                   const T* sink,
                   double* rho,
                   double* energy,
                   int first,
                   int nx) {
    L total = L::zero();
    L sunk = L::zero();
    for (std::ptrdiff_t i = first; i < nx; i += 2) {
      const L a = L::load(z + i * W);
      a.stream(out + i / 2 * W);
      total.add(a, L::load(r + i / 2 * W));
      L c = a;
      c.scale(sink[i]);
      sunk.add(a, c);
    }
    total.add_to(rho);
    sunk.add_to(energy);
  }

  static void energy(
      const T* sink, const T* inverse, const Stencil<T>& rows, double* sum, int first, int nx) {
    const Stencil<T> s = rows;  // not to be read again after every store
    L total = L::zero();
    for (std::ptrdiff_t i = first; i < nx; i += 2) {
      L z = L::zero();
      add_neighbours<W>(z, s, i);
      z.scale(inverse[i]);
      L a = z;
      a.scale(sink[i]);
      total.add(z, a);
      const auto add_face = [&](T g, const T* at) {
        L off = z;
        off.add(T{-1}, L::load(at + i * W));
        L flow = off;
        flow.scale(g);
        total.add(off, flow);
      };
      add_face(s.gx[i - 1], s.u - W);
      add_face(s.gx[i], s.u + W);
      add_face(s.gi_before[i], s.inner_before);
      add_face(s.gi_after[i], s.inner_after);
      add_face(s.go_before[i], s.outer_before);
      add_face(s.go_after[i], s.outer_after);
    }
    total.add_to(sum);
  }

  template <bool kRestarts, bool kBegins, bool kKeeps>
  static void step_as(const StepFactors<T>& f,
                      const S* z,
                      const T* s_before,
                      const T* d_before,
                      T* s,
                      T* d,
                      int nx) {
    const L along_z = L::load(f.z);
    const L along_before = L::load(f.before);
    const L growth = L::load(f.growth);
    const L shrink = L::load(f.shrink);
    for (std::ptrdiff_t i = 0; i < nx; ++i) {
      L a = L::load(z + i * W);
      a.scale(along_z);
      if constexpr (!kRestarts) a.add(along_before, L::load(s_before + i * W));
      L moved;
      if constexpr (kBegins) {
        moved = a;
        moved.scale(shrink);
      } else {
        const L before = L::load(d_before + i * W);
        moved = before;
        moved.add(shrink, a);
        a = moved;
        a.add(T{-1}, before);
        a.scale(growth);
      }
      if constexpr (kKeeps) moved.store(d + i * W);
      a.store(s + i * W);
    }
  }

  template <bool kRestarts, bool kBegins>
  static void step_to(const StepFactors<T>& f,
                      const S* z,
                      const T* s_before,
                      const T* d_before,
                      T* s,
                      T* d,
                      int nx) {
    if (d != nullptr)
      step_as<kRestarts, kBegins, true>(f, z, s_before, d_before, s, d, nx);
    else
      step_as<kRestarts, kBegins, false>(f, z, s_before, d_before, s, d, nx);
  }

  static void step(const StepFactors<T>& f,
                   const S* z,
                   const T* s_before,
                   const T* d_before,
                   T* s,
                   T* d,
                   int nx) {
    if (s_before == nullptr)
      d_before == nullptr ? step_to<true, true>(f, z, s_before, d_before, s, d, nx)
                          : step_to<true, false>(f, z, s_before, d_before, s, d, nx);
    else
      d_before == nullptr ? step_to<false, true>(f, z, s_before, d_before, s, d, nx)
                          : step_to<false, false>(f, z, s_before, d_before, s, d, nx);
  }

  static void relax(
      T* t, const T* sink, const T* inverse, const PackedStencil<T>& rows, int first, int nx) {
    const PackedStencil<T> s = rows;  // not to be read again after every store
    for (std::ptrdiff_t i = first; i < nx; i += 2) {
      L whole = L::zero();
      for_neighbours(s, i, W, [&](T g, const T* at) { whole.add(g, L::load(at)); });
      whole.scale(inverse[i]);
      L rest = whole;
      rest.scale(-sink[i]);
      for_neighbours(s, i, W, [&](T g, const T* at) {
        L off = L::load(at);
        off.add(T{-1}, whole);
        rest.add(g, off);
      });
      rest.scale(inverse[i]);
      whole.store(t + i / 2 * 2 * W);
      rest.store(t + (i / 2 * 2 + 1) * W);
    }
  }

  static void update(T* r,
                     const T* steps,
                     const T* sink,
                     const PackedStencil<T>& rows,
                     const T* factor,
                     double* sum,
                     int first,
                     int nx) {
    const PackedStencil<T> s = rows;  // not to be read again after every store
    const L f = L::load(factor);
    L total = L::zero();
    for (std::ptrdiff_t i = first; i < nx; i += 2) {
      const L u = L::load(steps + i / 2 * W);
      L q = u;
      q.scale(sink[i]);
      for_neighbours(s, i, 2 * W, [&](T g, const T* at) {
        L off = u;
        off.add(T{-1}, L::load(at));
        off.add(T{-1}, L::load(at + W));
        q.add(g, off);
      });
      L a = L::load(r + i / 2 * W);
      a.add(T{-1}, q);
      a.scale(f);
      a.store(r + i / 2 * W);
      total.add(a, a);
    }
    total.add_to(sum);
  }

  static void finish(
      T* d, const T* d_before, const T* r, const T* inverse, const T* shrink, int first, int nx) {
    const L factor = L::load(shrink);
    for (std::ptrdiff_t i = first; i < nx; i += 2) {
      const std::ptrdiff_t at = i / 2 * W;
      L a = L::load(r + at);
      a.scale(inverse[i]);
      L moved = d_before != nullptr ? L::load(d_before + at) : L::zero();
      moved.add(factor, a);
      moved.store(d + at);
    }
  }

  static RowKernels<T, S> table() {
    return {scale, prolong, sweep, restrict_row, copy, emit, energy, step, relax, update, finish};
  }
};

template <class T, class S>
RowKernels<T, S> table(int width) {
  switch (width) {
    case 1:
      return Kernels<T, S, 1>::table();
    case 4:
      return Kernels<T, S, 4>::table();
    case 8:
      return Kernels<T, S, 8>::table();
    default:
      return Kernels<T, S, 16>::table();
  }
}

RowKernels<float, float> single_table(int width) { return table<float, float>(width); }
RowKernels<float, Half> half_table(int width) { return table<float, Half>(width); }
RowKernels<double, double> double_table(int width) { return table<double, double>(width); }

const char* target_name() { return hwy::TargetName(HWY_TARGET); }

}  // namespace opaline::reconstruct::host::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace opaline::reconstruct::host {
HWY_EXPORT(single_table);
HWY_EXPORT(half_table);
HWY_EXPORT(double_table);
HWY_EXPORT(target_name);

template <>
RowKernels<float, float> row_kernels(int width) {
  return HWY_DYNAMIC_DISPATCH(single_table)(width);
}
template <>
RowKernels<float, Half> row_kernels(int width) {
  return HWY_DYNAMIC_DISPATCH(half_table)(width);
}
template <>
RowKernels<double, double> row_kernels(int width) {
  return HWY_DYNAMIC_DISPATCH(double_table)(width);
}

const char* instruction_set() { return HWY_DYNAMIC_DISPATCH(target_name)(); }

}  // namespace opaline::reconstruct::host
#endif
