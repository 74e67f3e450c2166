#pragma once

#include <array>
#include <cstddef>

namespace opaline::reconstruct::host {

/// Between the caller's fields in float64, one after another, and the passes' lanes, right-hand
/// sides side by side. T is what the passes compute in: float or double.

/// A line along x and those beside it; where the grid ends, any that can be read.
struct NearLines {
  const double* at;
  const double* y_before;
  const double* y_after;
  const double* z_before;
  const double* z_after;
};

/// The matrix along a line; g is zero where the grid ends.
struct LineCoefficients {
  const double* diagonal;
  const double* gx;
  const double* gy_before;
  const double* gy_after;
  const double* gz_before;
  const double* gz_after;
};

/// unit / D as the passes have it, of a line and those beside it.
template <class T>
struct InverseLines {
  double unit;  ///< 1 / HostGrid::unit
  const T* at;
  const T* y_before;
  const T* y_after;
  const T* z_before;
  const T* z_after;
};

/// Fields that share one look at the coefficients.
constexpr int kFieldsAtOnce = 2;

/// What becomes of the residual of a line of as many fields: r = scale (b - K x), packed, unless r is null; sums += the
/// sum of (b - K x)^2.
template <class T>
struct ResidualLines {
  const double* scale;
  T* const* r;
  double* sums;
};

/// One line of up to kFieldsAtOnce fields.
struct FieldLines {
  std::array<NearLines, kFieldsAtOnce> b;
  std::array<NearLines, kFieldsAtOnce> x;
  int count;
};

/// Numbers that a line of nx takes in a buffer, where whole registers are written.
constexpr std::size_t padded(int nx) { return (static_cast<std::size_t>(nx) + 31) / 16 * 16; }

/// Every other cell: a line's cells first, first + 2, ..., which lie side by side where they are packed.
template <class T>
struct FieldKernels {
  /// x = (b + sum g x) / D in every other cell of `to`, one line a field.
  void (*relax)(
      const LineCoefficients& k, const FieldLines& f, double* const* to, int first, int nx);
  /// b - K x in every other cell.
  void (*residual)(const LineCoefficients& k,
                   const FieldLines& f,
                   const ResidualLines<T>& to,
                   int first,
                   int nx);
  /// The same with x = b / D in the other cells and 0 in these: b + sum g b / D, the D of the neighbour. f.x is not read.
  void (*dark_residual)(const LineCoefficients& k,
                        const InverseLines<T>& inverse,
                        const FieldLines& f,
                        const ResidualLines<T>& to,
                        int first,
                        int nx);
  /// x += factor (c + more) in every other cell; both packed, either null.
  void (*add)(double* x, const T* c, const T* more, double factor, int first, int nx);
  /// fields[m stride + i] = lanes[i width + m].
  void (*to_fields)(const T* lanes, T* fields, std::size_t stride, int width, int nx);
  /// The way back.
  void (*to_lanes)(const T* fields, std::size_t stride, T* lanes, int width, int nx);
};

/// For the best instruction set of this processor.
template <class T>
FieldKernels<T> field_kernels();

}  // namespace opaline::reconstruct::host
