#pragma once

#include "render/scene/scene.h"

namespace opaline::render {

/// What a rough dielectric surface mirrors of light from one direction to another, the same for all channels, with F
/// Fresnel's reflectance of the facet whose normal is the half vector h, m the roughness and a the angle between n and h:
///
///   Cook-Torrance   f = D G F / (4 (n.l) (n.v)),  D = exp(-tan^2 a / m^2) / (pi m^2 cos^4 a)       (Beckmann),
///                   G = min(1, 2 (n.h)(n.v) / (v.h), 2 (n.h)(n.l) / (v.h))
///                                                   (Cook & Torrance, A reflectance model for computer graphics, 1982)
///   Ward            f = F exp(-tan^2 a / m^2) / (4 pi m^2 sqrt((n.l)(n.v)))
///                                          (Ward, Measuring and modeling anisotropic reflection, 1992, eq. 4, isotropic)
///
/// All vectors of length 1, away from the surface. 1/sr; 0 where l or v is below the surface, without specular, and for
/// ior 1, which mirrors nothing.
double specular_brdf(const SurfaceOptions& surface, double ior, Vec3 normal, Vec3 light, Vec3 view);

/// D above: its projection int D (n.h) dh is 1.
double beckmann(double cosine, double roughness);

}  // namespace opaline::render
