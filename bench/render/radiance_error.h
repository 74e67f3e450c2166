#pragma once

#include <array>
#include <memory>
#include <vector>

#include "base/thread_team.h"
#include "render/graph/optics.h"
#include "render/mesh/signed_distance.h"
#include "render/scene/subsurface.h"
#include "render/trace/triangle_tree.h"

namespace opaline::bench {

/// Each tetrahedron cut into eight at the middles of its edges: another discretisation of the same shape, facets and all.
render::TetMesh cut_into_eight(const render::TetMesh& mesh);

/// A marbled solid (marbled_optics) under a directional light, solved to 1e-8: what its surface sends along its normal,
///
///   L = F_t / (4 pi eta^2) (phi + 3 J_n),   red, green, blue
///
/// The solid must outlive it.
class LitMarble {
 public:
  LitMarble(const render::SignedDistance& solid,
            const render::DiffusionOptions& options,
            ThreadTeam& team);

  /// The same in tetrahedra that are there.
  LitMarble(render::TetMesh mesh,
            const render::SignedDistance& solid,
            const render::DiffusionOptions& options,
            ThreadTeam& team);

  /// Relative RMS, over its surface and all channels, of its radiance against another's: that one's fluence, interpolated linearly in
  /// the triangle that lies nearest along the normal, and where light enters at the surface (directions = 0) the flux
  /// J_n = (phi - S) / (2 A) of the light there, which is known everywhere: interpolated, too, its kink where it begins to graze
  /// would count as an error of whoever has a vertex there.
  double error_against(const LitMarble& reference) const;
  std::size_t tetrahedra() const { return body_->report().tetrahedra; }
  std::size_t unknowns() const { return body_->report().unknowns; }

  /// The dial between speed and accuracy: the relative residual of what follows.
  void set_tolerance(double tolerance) { body_->set_tolerance(tolerance); }
  /// Processor seconds of one lighting, median of `frames` with the light going round by 2 degrees each and ending where the
  /// constructor had it, each solution started from those before.
  double frame_seconds(int frames);

 private:
  LitMarble(std::unique_ptr<render::Subsurface> body,
            const render::SignedDistance& solid,
            bool is_followed);
  void light_from(double degrees);
  std::array<double, 3> truth_at(const render::RayHit& hit) const;
  const render::SignedDistance* solid_;
  bool is_followed_;
  std::unique_ptr<render::Subsurface> body_;
};

}  // namespace opaline::bench
