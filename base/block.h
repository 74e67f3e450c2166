#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "base/pose.h"

namespace opaline {

/// A face of the sample block, by its outward normal in the sample's frame.
enum class Face : std::uint8_t { kXMin, kXMax, kYMin, kYMax, kZMin, kZMax };
inline constexpr std::array kFaces{
    Face::kXMin, Face::kXMax, Face::kYMin, Face::kYMax, Face::kZMin, Face::kZMax};

/// "x_min" ... "z_max", as in files and configuration.
constexpr std::string_view to_string(Face face) {
  constexpr std::array<std::string_view, 6> names{
      "x_min", "x_max", "y_min", "y_max", "z_min", "z_max"};
  return names[static_cast<std::size_t>(face)];
}

/// 0, 1 or 2: the axis the face is perpendicular to.
constexpr int axis_of(Face face) { return static_cast<int>(face) / 2; }
/// Whether the outward normal points along +axis.
constexpr bool is_max(Face face) { return static_cast<int>(face) % 2 == 1; }

/// The sample as a box of nx x ny x nz equal cells.
///
/// The sample's frame has its origin at the corner of cell (0,0,0); cell (i,j,k) spans
/// [i hx, (i+1) hx] x [j hy, (j+1) hy] x [k hz, (k+1) hz], in mm. Face z_max looks at the camera,
/// z_min away from it. Cells are stored x fastest: index = (k ny + j) nx + i.
///
/// Cells of a face are a raster of width x height, column fastest: on x faces (column, row) = (j,
/// k), on y faces (i, k), on z faces (i, j).
struct Block {
  int nx = 1;
  int ny = 1;
  int nz = 1;
  double hx = 1.0;
  double hy = 1.0;
  double hz = 1.0;

  std::size_t cell_count() const { return static_cast<std::size_t>(nx) * ny * nz; }
  std::size_t index(int i, int j, int k) const {
    return (static_cast<std::size_t>(k) * ny + j) * nx + i;
  }
  std::array<int, 3> cells() const { return {nx, ny, nz}; }
  std::array<double, 3> spacing() const { return {hx, hy, hz}; }
  Vec3 size() const { return {nx * hx, ny * hy, nz * hz}; }
  double cell_volume() const { return hx * hy * hz; }

  int face_width(Face face) const { return axis_of(face) == 0 ? ny : nx; }
  int face_height(Face face) const { return axis_of(face) == 2 ? ny : nz; }
  std::size_t face_cell_count(Face face) const {
    return static_cast<std::size_t>(face_width(face)) * face_height(face);
  }
  double face_cell_area(Face face) const { return cell_volume() / spacing()[axis_of(face)]; }
  /// The cell behind raster position (column, row) of a face.
  std::size_t cell_behind(Face face, int column, int row) const {
    const int last = cells()[axis_of(face)] - 1;
    const int depth = is_max(face) ? last : 0;
    switch (axis_of(face)) {
      case 0:
        return index(depth, column, row);
      case 1:
        return index(column, depth, row);
      default:
        return index(column, row, depth);
    }
  }
  /// The centre of a face cell, in the sample's frame, mm.
  Vec3 face_cell_centre(Face face, int column, int row) const {
    const double last = is_max(face) ? 1.0 : 0.0;
    switch (axis_of(face)) {
      case 0:
        return {last * nx * hx, (column + 0.5) * hy, (row + 0.5) * hz};
      case 1:
        return {(column + 0.5) * hx, last * ny * hy, (row + 0.5) * hz};
      default:
        return {(column + 0.5) * hx, (row + 0.5) * hy, last * nz * hz};
    }
  }
  bool operator==(const Block&) const = default;
};

}  // namespace opaline
