#pragma once

#include <cmath>

namespace opaline::render {

inline constexpr int kLanes =
    4;  ///< red, green, blue, and one that stays 0: what one register holds

/// One number for each channel, added and multiplied at once.
template <class T>
struct Lanes {
  typedef T Register __attribute__((
      vector_size(16)));  // NOLINT(modernize-use-using): `using` takes no attribute here
  static constexpr int kRegisters = kLanes * static_cast<int>(sizeof(T)) / 16;
  static constexpr int kWidth = kLanes / kRegisters;

  Register part[kRegisters];

  static Lanes all(T value) {
    Lanes lanes{};
    for (int r = 0; r < kRegisters; ++r) lanes.part[r] = Register{} + value;
    return lanes;
  }
  static Lanes zero() { return all(T{0}); }

  T operator[](int lane) const { return part[lane / kWidth][lane % kWidth]; }
  void set(int lane, T value) { part[lane / kWidth][lane % kWidth] = value; }

  Lanes& operator+=(const Lanes& b) {
    for (int r = 0; r < kRegisters; ++r) part[r] += b.part[r];
    return *this;
  }
  Lanes& operator-=(const Lanes& b) {
    for (int r = 0; r < kRegisters; ++r) part[r] -= b.part[r];
    return *this;
  }
  Lanes& operator*=(const Lanes& b) {
    for (int r = 0; r < kRegisters; ++r) part[r] *= b.part[r];
    return *this;
  }
  Lanes& operator*=(T b) {
    for (int r = 0; r < kRegisters; ++r) part[r] *= b;
    return *this;
  }
  friend Lanes operator+(Lanes a, const Lanes& b) { return a += b; }
  friend Lanes operator-(Lanes a, const Lanes& b) { return a -= b; }
  friend Lanes operator*(Lanes a, const Lanes& b) { return a *= b; }
  friend Lanes operator*(Lanes a, T b) { return a *= b; }
};

/// a / b lane by lane; 0 where b is 0.
template <class T>
Lanes<T> divide(const Lanes<T>& a, const Lanes<T>& b) {
  Lanes<T> quotient = Lanes<T>::zero();
  for (int lane = 0; lane < kLanes; ++lane) {
    if (b[lane] != T{0}) quotient.set(lane, a[lane] / b[lane]);
  }
  return quotient;
}

}  // namespace opaline::render
