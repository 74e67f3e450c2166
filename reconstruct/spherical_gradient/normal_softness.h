#pragma once

#include "reconstruct/spherical_gradient/scattering_maps.h"

namespace opaline::reconstruct {

/// Mean of the squared distance that light goes along one axis of the surface, mm^2, by the dipole: z_r = 3 D and z_v = D (3 + 4 A) below and above it,
///
///   s^2 = l_d sum z e^(-z/l_d) / sum e^(-z/l_d)
double spread_along_axis(double translucency, double diffusion, double ior);

/// Photometric normals of translucent objects are soft (Ma et al. 2007): the gradients' vector is a mean of the normals from which the light came, which
/// to second order in its way is n + s^2/2 lap n. On a surface lap n = grad (2 H) - |A|^2 n, so the vector leaves the normal by
///
///   s^2 grad H,     grad H = (1 - n n^T) (dH/dx, dH/dy, 0),
///
/// nothing on a ball. That is taken away, at most 0.2 radians; the slope of H is that of a plane within s of the pixel. Pixels without an answer take the
/// median s of those that have one; where none has, normals stay as they are. Curvatures stay: what they belong to, r, is as soft.
/// Threads: as `team`.
void sharpen_normals(const GradientPictures& pictures,
                     double ior,
                     ThreadTeam& team,
                     ScatteringMaps& maps);

}  // namespace opaline::reconstruct
