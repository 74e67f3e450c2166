#pragma once

#include "base/surface_reflectance.h"
#include "render/scene/scene.h"

namespace opaline::render {

/// What a captured surface reflects by itself (Wang 2008, sec. 6.1), laid over an object made of the same session's material:
/// under irradiance E (n.l) it shows
///
///   L = rho_s E (n.l)
///
/// on top of what diffuses, as the reconstruction has it, which takes nothing of that from the light that enters. It was
/// measured with light and camera across the face; here it is the same from and to every side.
///
/// As `origin`, `scale` and `tiling` of the options lay the block: a shape cut from it has at each place what the face has in
/// front of it; around a shape (Placement::kShell) the face is laid three times, as each axis sees it, blended by n_k^4
/// (render/scene/shell_material.h). Bilinear between cells that were measured; where none was, their mean. Below 0, which is
/// noise, it is 0.
///
/// Units: mm, 1/sr. Threads: at() may be called from several threads.
class MeasuredFinish {
 public:
  /// Reads options.surface_reflectance. Errors: those of read_surface(); kInvalidArgument where no cell was measured.
  static Result<MeasuredFinish> create(const TranslucentOptions& options);

  /// rho_s at a place of the surface in the shape's own frame at rest, and its normal there.
  Colour at(Vec3 place, Vec3 normal) const;

 private:
  MeasuredFinish(SurfaceReflectance surface, const TranslucentOptions& options)
      : surface_(std::move(surface)), options_(options) {}
  Colour on_face(double column_mm, double row_mm) const;

  SurfaceReflectance surface_;
  TranslucentOptions options_;
  Colour mean_{};  // of the cells that were measured
};

}  // namespace opaline::render
