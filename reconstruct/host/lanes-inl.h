// The instruction set of whoever includes it (Highway's foreach_target.h): included once for each.
#if defined(OPALINE_RECONSTRUCT_HOST_LANES_INL_H) == defined(HWY_TARGET_TOGGLE)
#ifdef OPALINE_RECONSTRUCT_HOST_LANES_INL_H
#undef OPALINE_RECONSTRUCT_HOST_LANES_INL_H
#else
#define OPALINE_RECONSTRUCT_HOST_LANES_INL_H
#endif

#include <hwy/highway.h>

#include <cstddef>
#include <type_traits>

#include "reconstruct/host/row_kernels.h"

HWY_BEFORE_NAMESPACE();
namespace opaline::reconstruct::host::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

/// The right-hand sides of one cell: W numbers in kCount registers.
template <class T, int W>
struct Lanes {
  using D = hn::CappedTag<T, W>;
  using H = hn::Rebind<hwy::float16_t, D>;
  using V = hn::Vec<D>;
  static constexpr std::ptrdiff_t kLanes = static_cast<std::ptrdiff_t>(hn::MaxLanes(D()));
  static constexpr int kCount = W / kLanes;

  V v[kCount];

  static HWY_INLINE Lanes load(const T* at) {
    Lanes a;
    for (int n = 0; n < kCount; ++n) a.v[n] = hn::LoadU(D(), at + n * kLanes);
    return a;
  }
  static HWY_INLINE Lanes load(const Half* at) {
    const auto* from = reinterpret_cast<const hwy::float16_t*>(at);
    Lanes a;
    for (int n = 0; n < kCount; ++n) a.v[n] = hn::PromoteTo(D(), hn::LoadU(H(), from + n * kLanes));
    return a;
  }
  static HWY_INLINE Lanes zero() {
    Lanes a;
    for (int n = 0; n < kCount; ++n) a.v[n] = hn::Zero(D());
    return a;
  }
  HWY_INLINE void store(T* at) const {
    for (int n = 0; n < kCount; ++n) hn::StoreU(v[n], D(), at + n * kLanes);
  }
  /// Past the caches, where that is worth it: nobody asks for it before the next pass.
  template <class To>
  HWY_INLINE void stream(To* at) const {
    if constexpr (W == 16 && std::is_same_v<To, float>)
      for (int n = 0; n < kCount; ++n) hn::Stream(v[n], D(), at + n * kLanes);
    else
      store(at);
  }
  HWY_INLINE void store(Half* at) const {
    auto* to = reinterpret_cast<hwy::float16_t*>(at);
    const V most = hn::Set(D(), T{65504});
    for (int n = 0; n < kCount; ++n) {
      const V within = hn::Max(hn::Neg(most), hn::Min(most, v[n]));
      hn::StoreU(hn::DemoteTo(H(), within), H(), to + n * kLanes);
    }
  }
  /// += factor * a, one factor for all lanes.
  HWY_INLINE void add(T factor, const Lanes& a) {
    const V f = hn::Set(D(), factor);
    for (int n = 0; n < kCount; ++n) v[n] = hn::MulAdd(f, a.v[n], v[n]);
  }
  HWY_INLINE void scale(T factor) {
    const V f = hn::Set(D(), factor);
    for (int n = 0; n < kCount; ++n) v[n] = hn::Mul(v[n], f);
  }
  HWY_INLINE void scale(const Lanes& factor) {
    for (int n = 0; n < kCount; ++n) v[n] = hn::Mul(v[n], factor.v[n]);
  }
  /// += a * b, lane by lane.
  HWY_INLINE void add(const Lanes& a, const Lanes& b) {
    for (int n = 0; n < kCount; ++n) v[n] = hn::MulAdd(a.v[n], b.v[n], v[n]);
  }
  /// factor * this, added to what lies at `at`.
  HWY_INLINE void add_scaled_to(T* at, T factor) const {
    const V f = hn::Set(D(), factor);
    for (int n = 0; n < kCount; ++n)
      hn::StoreU(hn::MulAdd(f, v[n], hn::LoadU(D(), at + n * kLanes)), D(), at + n * kLanes);
  }
  HWY_INLINE void add_to(double* sum) const {
    T values[W];
    store(values);
    for (int m = 0; m < W; ++m) sum[m] += static_cast<double>(values[m]);
  }
};

}  // namespace opaline::reconstruct::host::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
