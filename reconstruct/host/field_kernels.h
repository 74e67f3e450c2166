#pragma once

#include <cstddef>

namespace opaline::reconstruct::host {

/// Between the caller's fields in float64, one after another, and the passes' lanes, right-hand
/// sides side by side. T is what the passes compute in: float or double.

/// One line of one field along x; rows of x outside the grid are null, and x itself where it is zero.
struct FieldLine {
  const double* b;
  const double* x;
  const double* y_before;
  const double* y_after;
  const double* z_before;
  const double* z_after;
  const double* diagonal;
  const double* gx;  ///< 0 in the last cell
  const double* gy_before;
  const double* gy_after;
  const double* gz_before;
  const double* gz_after;
};

/// Numbers that a line of nx takes in a buffer, where whole registers are written.
constexpr std::size_t padded(int nx) { return (static_cast<std::size_t>(nx) + 31) / 16 * 16; }

/// Every other cell: a line's cells first, first + 2, ..., which lie side by side where they are packed.
template <class T>
struct FieldKernels {
  /// x = (b + sum g x) / D in every other cell; a null line.x is zero.
  void (*relax)(const FieldLine& line, double* x, int first, int nx);
  /// r = scale (b - K x) in every other cell, packed, unless r is null; returns the sum of (b - K x)^2
  /// there.
  double (*residual)(const FieldLine& line, double scale, T* r, int first, int nx);
  /// x += factor c in every other cell; c packed.
  void (*add)(double* x, const T* c, double factor, int first, int nx);
  /// fields[m stride + i] = d + step[m] p of lane m in cell i; without d that is zero.
  void (*to_fields)(
      const T* d, const T* p, const T* step, T* fields, std::size_t stride, int width, int nx);
  /// The way back: lanes[i width + m] = fields[m stride + i].
  void (*to_lanes)(const T* fields, std::size_t stride, T* lanes, int width, int nx);
};

/// For the best instruction set of this processor.
template <class T>
FieldKernels<T> field_kernels();

}  // namespace opaline::reconstruct::host
