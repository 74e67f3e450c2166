#pragma once

#include "base/block.h"

namespace opaline::capture {

/// The point of a face at (u, v), counted in cells of its raster: (0, 0) is the raster's first
/// corner, (1, 1) the opposite corner of its first cell. In the sample's frame, mm.
inline Vec3 face_point(const Block& block, Face face, double u, double v) {
  const double last = is_max(face) ? 1.0 : 0.0;
  switch (axis_of(face)) {
    case 0:
      return {last * block.nx * block.hx, u * block.hy, v * block.hz};
    case 1:
      return {u * block.hx, last * block.ny * block.hy, v * block.hz};
    default:
      return {u * block.hx, v * block.hy, last * block.nz * block.hz};
  }
}

inline Vec3 outward_normal(Face face) {
  const double sign = is_max(face) ? 1.0 : -1.0;
  return {axis_of(face) == 0 ? sign : 0.0,
          axis_of(face) == 1 ? sign : 0.0,
          axis_of(face) == 2 ? sign : 0.0};
}

/// Width and height of one cell of the face's raster, mm.
struct CellSize {
  double width = 0.0;
  double height = 0.0;
};
inline CellSize face_cell_size(const Block& block, Face face) {
  return {axis_of(face) == 0 ? block.hy : block.hx, axis_of(face) == 2 ? block.hy : block.hz};
}

}  // namespace opaline::capture
