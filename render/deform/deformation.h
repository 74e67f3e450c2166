#pragma once

#include <memory>

#include "base/result.h"
#include "render/deform/deform_options.h"
#include "render/mesh/triangle_mesh.h"

namespace opaline::render {

/// Where a body's matter goes: a smooth map of places at rest. Lengths in mm.
///
/// Threads: everything may be called from several threads.
class Deformation {
 public:
  virtual ~Deformation() = default;
  virtual Vec3 at(Vec3 rest) const = 0;

  /// The normal, of length 1, of a surface that had `normal` at `rest`: cof(J) n, J the map's derivative by central
  /// differences over 2 `step`; zero where the map is flat.
  Vec3 normal(Vec3 rest, Vec3 normal, double step) const;
};

/// The deformation of an object that fills `bounds` in its own frame, as a map of the scene:
///
///   cage    x + sum_ijk B_i(s) B_j(t) B_k(u) d_ijk, Bernstein polynomials over the box, d the moves of its control points
///                                        (Sederberg & Parry, Free-form deformation of solid geometric models, 1986)
///   bones   sum_b w_b T_b x, w_b ~ 1 / (distance to the bone)^4, T_b = T_parent . (rotation about its head, then move)
///           (linear blend skinning: Magnenat-Thalmann, Laperriere & Thalmann, Joint-dependent local deformations, 1988)
///
/// Errors: kInvalidArgument for what validate() refuses, and for `kind` none.
Result<std::unique_ptr<Deformation>> make_deformation(const DeformOptions& options,
                                                      const Box& bounds,
                                                      const Pose& scene_from_object);

}  // namespace opaline::render
