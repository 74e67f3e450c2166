#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "base/pose.h"
#include "reconstruct/spherical_gradient/exit_law.h"
#include "reconstruct/spherical_gradient/lamp_shapes.h"
#include "reconstruct/spherical_gradient/stage_correction.h"

namespace opaline::reconstruct {

/// Constant and signed gradients of one pixel.
struct Measured {
  double constant = 0.0;
  std::array<double, 3> gradient{};
};

inline double length_of(const Measured& m) {
  return std::sqrt(m.gradient[0] * m.gradient[0] + m.gradient[1] * m.gradient[1] +
                   m.gradient[2] * m.gradient[2]);
}
inline Vec3 normal_of(const Measured& m) {
  return Vec3{m.gradient[0], m.gradient[1], m.gradient[2]} * (1.0 / length_of(m));
}

/// The correction of a block of pixels, linear in the normal: what takes the place of a pixel's constant light, and what is added to its gradients, over its constant light.
struct LinearCorrection {
  Vec3 normal;
  std::array<double, 4> value{};
  std::array<Vec3, 4> slope{};
  double at(std::size_t k, Vec3 n) const { return value[k] + dot(slope[k], n - normal); }
};

/// What stage_correction.h says of one pixel, or of a block of them. Threads: const, any number; pictures and record must outlive it.
class LampCorrection {
 public:
  LampCorrection(const StagePictures& pictures, const StageRecord& stage, double ior);

  Measured measured(std::size_t at) const {
    Measured m{p_.constant.radiance[at], {}};
    for (std::size_t a = 0; a < 3; ++a)
      m.gradient[a] = p_.minuses.empty()
                          ? 2.0 * p_.gradients[a].radiance[at] - m.constant
                          : p_.gradients[a].radiance[at] - p_.minuses[a].radiance[at];
    return m;
  }

  /// The same as ideal patterns show it, by what is known of the pixel so far.
  Measured corrected(const Measured& raw, const Measured& known, Vec3 place) const;

  /// Twice over: with what is known of the pixel at first, and with what that makes of it.
  Measured corrected_twice(const Measured& raw, Vec3 place) const;

  /// `mean` or the sum is of a block's pixels, and must have light and a direction.
  LinearCorrection linear(const Measured& mean, Vec3 place) const;
  /// A pixel of the block.
  static Measured corrected(const Measured& raw, const LinearCorrection& linear);

  Vec3 place(int x, int y, double depth) const {
    const double nearer = stage_.distance_mm > 0.0 ? 1.0 - depth / stage_.distance_mm : 1.0;
    const double pixel = stage_.pixel_mm * nearer;
    return {(x + 0.5 - stage_.middle_x) * pixel, (y + 0.5 - stage_.middle_y) * pixel, depth};
  }
  double pixel_scale(Vec3 place, const Measured& m) const {
    if (!(stage_.distance_mm > 0.0) || !(m.gradient[2] > 0.0)) return 1.0;
    const double slanted = (place.x * m.gradient[0] + place.y * m.gradient[1]) / m.gradient[2];
    const double scale =
        (1.0 - place.z / stage_.distance_mm) * (1.0 + 0.5 * slanted / stage_.distance_mm);
    return std::clamp(scale, 0.8, 1.25);
  }
  double exit_law(double normal_z) const { return law_.at(normal_z); }
  double surroundings() const { return surroundings_; }

 private:
  struct Lamp {
    Vec3 position;  // along the pictures' axes, mm from what the middle of the picture sees
    std::array<double, 4> power{};  // I code/255 of the constant and of the gradients, signed
  };
  Lamp lamp(std::size_t n) const;

  const StagePictures& p_;
  const StageRecord& stage_;
  LampShapes shapes_;
  ExitLaw law_;
  double surroundings_;
  std::vector<Lamp> lamps_;
};

}  // namespace opaline::reconstruct
