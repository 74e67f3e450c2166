#pragma once

#include <vector>

#include "base/thread_team.h"
#include "render/graph/optics.h"
#include "render/mesh/signed_distance.h"
#include "render/scene/subsurface.h"

namespace opaline::bench {

/// Each tetrahedron cut into eight at the middles of its edges: another discretisation of the same shape, facets and all.
render::TetMesh cut_into_eight(const render::TetMesh& mesh);

/// A marbled solid (marbled_optics) under a directional light, solved to 1e-8: what its surface sends along its normal,
///
///   L = F_t / (4 pi eta^2) (phi + 3 J_n),   red, green, blue
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

  /// Relative RMS, over its surface and all channels, of its radiance against another's, which is interpolated linearly in
  /// the triangle that lies nearest along the normal.
  double error_against(const LitMarble& reference) const;
  std::size_t tetrahedra() const { return body_->report().tetrahedra; }
  std::size_t unknowns() const { return body_->report().unknowns; }

  /// The dial between speed and accuracy: the relative residual of what follows.
  void set_tolerance(double tolerance) { body_->set_tolerance(tolerance); }
  /// Processor seconds of one lighting, median of `frames` with the light going round by 2 degrees each and ending where the
  /// constructor had it, each solution started from those before.
  double frame_seconds(int frames);

 private:
  void light_from(double degrees);
  std::unique_ptr<render::Subsurface> body_;
};

}  // namespace opaline::bench
