#pragma once

#include <vector>

#include "render/scene/beam_deposit.h"
#include "render/scene/drawn_surface.h"
#include "render/scene/scene.h"
#include "render/scene/surfaces.h"

namespace opaline::render {

/// Light of lamps that a camera sees after it was scattered once, along the refracted ray (Wang 2010, single scattering; the
/// formal solution of the transport equation over the lamps' beams, docs/physics.md, "Light that was scattered once"):
///
///   L_1 = F_t / (4 pi ior^2) Phi_1,   Phi_1 = sum_n alpha' (E_(n-1) - E_n) phi_b(x_n)       as BeamDeposit has them
///   phi_b = sum over lamps of (1 - R(mu)) E mu / mu_i e^(-tau)                              of the beam through x_n
///
/// The beam's way in is found by going straight to the lamp, refracting the lamp's light where that leaves, and going there, until the
/// direction stays. Left out: what a curved surface gathers or spreads of a beam, and beams mirrored inside.
///
/// Threads: const, so any number at a time.
class SingleScattering {
 public:
  /// Everything must outlive it, and may change with the scene. `drawn`: `surface`, the faces of `inside`, made finer.
  SingleScattering(const BeamDeposit& inside,
                   const TriangleMesh& surface,
                   const DrawnSurface& drawn,
                   const Surfaces& surfaces,
                   const std::vector<LightOptions>& lamps,
                   double ior)
      : inside_(inside),
        surface_(surface),
        drawn_(drawn),
        surfaces_(surfaces),
        lamps_(lamps),
        ior_(ior) {}

  /// Phi_1 behind a place on a triangle of the drawn surface, along a direction inside.
  Colour seen(std::size_t triangle, Vec3 place, Vec3 along) const;

 private:
  Colour beams(int tet, Vec3 place) const;
  Colour beam(const LightOptions& lamp, int tet, Vec3 place) const;
  SurfacePlace smooth(int face, Vec3 place) const;

  const BeamDeposit& inside_;
  const TriangleMesh& surface_;
  const DrawnSurface& drawn_;
  const Surfaces& surfaces_;
  const std::vector<LightOptions>& lamps_;
  double ior_;
};

}  // namespace opaline::render
