#pragma once

#include <array>
#include <limits>
#include <string_view>

#include "base/thread_team.h"
#include "render/scene/scene.h"

namespace opaline::bench {

/// How far the exitance of a marbled solid (marbled_optics, green) is from Monte Carlo through its tetrahedra, in patches of
/// 2.5 mm: relative RMS weighted by area, the Monte Carlo's own noise taken out in squares.
struct TransportError {
  double total = 0.0;  ///< diffusion as asked for, against Monte Carlo
  double model = 0.0;  ///< diffusion on elements of half the size, against Monte Carlo
  double discretisation =
      0.0;             ///< diffusion as asked for, against that on elements of half the size
  double noise = 0.0;  ///< of the Monte Carlo
  int patches = 0;
  /// The model's error where the solid is so many mean free paths thick below the patch, and no less than the band before.
  struct Band {
    double below = 0.0;
    double model = 0.0;     ///< relative RMS within the band
    double bias = 0.0;      ///< of the power that leaves there
    double area_mm2 = 0.0;  ///< how much of the surface that is
  };
  std::array<Band, 3> bands{{{4.0}, {8.0}, {std::numeric_limits<double>::infinity()}}};
};

/// Light q = n.l from one side, without shadows. Index-matched and diffuse; or collimated at eta = 1.3, transmitted and
/// refracted after Fresnel. Light that leaves without a collision is left out of the collimated case.
TransportError transport_error(std::string_view shape,
                               bool collimated,
                               const render::DiffusionOptions& options,
                               double photons,
                               ThreadTeam& team);

/// How far the radiance of a marbled solid in collimated light at eta = 1.3, lit from one side, is from Monte Carlo in the same patches: light
/// that leaves within 18 degrees of `seen`, the angle between which and the light is given. Relative RMS weighted by area.
struct RadianceError {
  double diffused = 0.0;  ///< with single scattering left to diffusion
  double sharp = 0.0;     ///< with single scattering as itself
  double noise = 0.0;     ///< of the Monte Carlo, taken out of both
};
RadianceError radiance_error(std::string_view shape,
                             double degrees,
                             const render::DiffusionOptions& options,
                             double photons,
                             ThreadTeam& team);

}  // namespace opaline::bench
