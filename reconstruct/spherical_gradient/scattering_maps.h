#pragma once

#include <array>
#include <cstdint>
#include <string_view>
#include <vector>

#include "base/result.h"
#include "base/thread_team.h"
#include "reconstruct/spherical_gradient/ball_table.h"
#include "reconstruct/spherical_gradient/shared_deviations.h"

namespace opaline::reconstruct {

/// What GradientPictures::measured says of a pixel.
inline constexpr std::uint8_t kNotSeen = 0;  ///< outside the object, hot, blurred by its outline
inline constexpr std::uint8_t kMeasured = 1;
inline constexpr std::uint8_t kClipped = 2;  ///< saturated in some picture

/// One channel of four cross-polarised pictures of an object among lights, seen along z by an orthographic camera: constant light, and the
/// gradients (1 + omega_x)/2, (1 + omega_y)/2, (1 + omega_z)/2, omega the direction to the light. y points down the picture's rows.
struct GradientPictures {
  int width = 0;
  int height = 0;
  double pixel_mm = 0.1;
  double white =
      1.0;  ///< what a surface that gives back all of the light shows under constant light
  std::array<std::vector<float>, 4> radiance;
  std::array<std::vector<float>, 4> variance;
  std::vector<std::uint8_t> measured;
  /// How many times pixel_mm one step of a pixel goes along the object, across the line of sight, on average of row and column: perspective.
  /// None: 1 everywhere.
  std::vector<float> pixel_scale = {};
};

/// Why a pixel has no answer.
enum class LeftOut : std::uint8_t {
  kFound,            ///< it has one
  kNotMeasured,      ///< as the pictures say, or without light
  kSaturated,        ///< in some picture
  kTooFlat,          ///< its curvature is not certainly above zero
  kConcave,          ///< its curvature is certainly below zero
  kBelowNoise,       ///< its ratio is not certainly above that of a flat surface
  kTooTranslucent,   ///< for its curvature
  kBeyondTable,      ///< brighter or darker than what was traced
  kInterreflection,  ///< a certainly concave place within 2 l_d lights it (shape_reach.h)
  kUneven,  ///< bends so unevenly about it that ln D would be uncertain by more than a half
};
inline constexpr int kLastReason = static_cast<int>(LeftOut::kUneven);
std::string_view to_string(LeftOut reason);  ///< "found", "not measured", "too flat", ...

struct MapOptions {
  std::vector<int> half_windows{
      2, 4, 8, 16, 32};  ///< pixels; the smallest that is certain enough is taken
  /// A larger window's curvature and ratio must lie within so many deviations of the smaller one's, or that one is kept, however uncertain: the object
  /// bends or changes within the larger (intersection of confidence intervals, Goldenshluger & Nemirovski 1997).
  double agree = 3.0;
  double certain =
      0.04;  ///< relative deviation of curvature and of the ratio beyond a flat surface's that is certain enough
  double sigmas = 2.0;  ///< of what is called certain in LeftOut
  double normal_certain =
      0.004;  ///< standard deviation of a normal, radians, that needs no larger window
  SharedDeviations shared = {};  ///< how well lamps and white are known
  double ior = 1.4;              ///< 1 to 3; of the tilt below
  /// Tables of the lowest and the highest index that the object may have, which must outlive the call; none: the index is known. Half of what
  /// they make of ln D and alpha' counts as a deviation, and a pixel that has an answer in one only is left out.
  const BallTable* lower_index = nullptr;
  const BallTable* higher_index = nullptr;
};

struct ScatteringMaps {
  int width = 0;
  int height = 0;
  /// Of planes fitted in the smallest window that is certain enough (MapOptions::normal_certain); of each pixel by itself where none has six pixels.
  std::vector<float> normal_x, normal_y, normal_z;
  std::vector<float> curvature;            ///< mean, 1/mm; > 0 where the object bulges
  std::vector<float> curvature_deviation;  ///< standard deviation by noise, 1/mm
  std::vector<float> reduced_albedo;
  std::vector<float> diffusion;           ///< D = 1/(3 sigma_t'), mm
  std::vector<float> translucency;        ///< l_d = 1/sigma_tr, mm
  std::vector<float> reduced_scattering;  ///< sigma_s', 1/mm
  std::vector<float> absorption;          ///< sigma_a, 1/mm
  std::vector<float>
      log_diffusion_deviation;  ///< standard deviation of ln D: noise and the table's own
  std::vector<float> albedo_deviation;
  std::vector<LeftOut> left_out;  ///< where not kFound, the maps from reduced_albedo on hold 0
};

/// Scattering parameters of every pixel (Zhu et al. 2013, by traced balls instead of the dipole: ball_table.h). Normals after Ma et al. 2007, from
/// the pictures with half of the constant one taken away; noise of the pictures is carried to the results.
///
/// A camera that looks aslant sees light that came in aside of where it looks, as if one mean free path deep along its refracted ray, so on a surface of
/// mean curvature H the gradients' vector is tilted away from the camera, theta the angle between them, by
///
///   delta = c sin(theta),   c = H / (sigma_t' ior) = 3 D H / ior     (within 20 % of Monte Carlo: tests/.../camera_tilt_test.cc)
///
/// which makes curvature too large by 1 + c (cos theta - sin^2 theta / (2 cos theta)) on a ball. Both are taken out where D is found; a fifth of the latter
/// is in the deviation. Where the principal curvatures differ, the table's answer is moved by BallTable::curvature_where, three tenths of which are in the deviation;
/// the normals found are sharpened (normal_softness.h).
///
/// Errors: kInvalidArgument where sizes or numbers do not fit.
Result<ScatteringMaps> estimate_scattering(const GradientPictures& pictures,
                                           const BallTable& table,
                                           const MapOptions& options,
                                           ThreadTeam& team);

}  // namespace opaline::reconstruct
