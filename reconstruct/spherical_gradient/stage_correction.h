#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "base/result.h"
#include "base/stage_record.h"
#include "base/thread_team.h"
#include "reconstruct/spherical_gradient/scattering_maps.h"

namespace opaline::reconstruct {

/// One channel of a light stage's pictures as they were taken, and the codes of the lamps in them.
struct StagePictures {
  struct Picture {
    std::vector<float> radiance;
    std::vector<float> variance;
    std::vector<std::uint8_t> codes;  ///< one a lamp
  };
  int width = 0;
  int height = 0;
  Picture constant;
  /// Under (1 + omega_a)/2, a = x, y, z; or, where there are minuses, under max(omega_a, 0).
  std::array<Picture, 3> gradients;
  std::vector<Picture> minuses;        ///< under max(-omega_a, 0); none, or three
  std::vector<std::uint8_t> measured;  ///< as in GradientPictures
};

/// What distant lights in ideal patterns would have shown of it. A stage has lamps in some places only, rounds their codes, and stands so near that
/// directions and brightness differ over the object by its size over the stage's: 2 % on 12 of 600 mm, more than a flat surface and
/// a translucent ball may differ by. So each pixel's pictures are predicted from all lamps as they were, and from ideal patterns, with
///
///   S = sum_j c_j I_j / d_j^2 f(n . omega_j)     and     S = L int p(omega) f(n . omega) domega,   L = sum_j c_j I_j / (4 pi |p_j|^2)
///
/// d_j, omega_j from the pixel's place, and take the difference: C by the ratio, gradients by the difference in units of C / S. f is the light that one
/// direction makes leave: Fresnel's transmittance times the clamped cosine, its Legendre coefficients damped by 1/(1 + l (l + 1) c), c so that
/// its ratio is the r measured. Only the small difference depends on that shape. Twice over: normals and r get better.
///
/// Where normals turn slowly from pixel to pixel, the difference is found for blocks of up to 16 x 16 of them, within which they turn by a hundredth, and taken as
/// linear in the normal there: what that leaves out is its second order, 1e-4 of a picture at most.
///
/// A pixel's depth, which decides its distance to lamps, is taken from its normal and mean curvature, n_z / H over the object's plane (exact on
/// balls; 0 to half the object's width).
///
/// A camera at a finite distance d sees what is nearer larger: a step of a pixel is (1 - z/d) (1 + (X n_x + Y n_y) / (2 d n_z)) times pixel_mm on the
/// object, X, Y from the picture's middle, z the depth, n the normal (pixel_scale; first order in the object's size over d).
///
/// What leaves towards the camera is more along the normal than at grazing angles; radiance becomes exitance over pi by
/// (1 - F(n_z)) / (1 - 2 int F mu dmu), light that arrives evenly below the surface, `ior` its index.
///
/// Errors: kInvalidArgument where sizes do not fit.
Result<GradientPictures> ideal_pictures(const StagePictures& pictures,
                                        const StageRecord& stage,
                                        double ior,
                                        ThreadTeam& team);

/// Radiance of the even surroundings that codes amount to, W/(mm^2 sr): L above.
double surrounding_radiance(std::span<const SphereLight> lights,
                            std::span<const std::uint8_t> codes);

}  // namespace opaline::reconstruct
