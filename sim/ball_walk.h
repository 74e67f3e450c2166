#pragma once

#include <cmath>
#include <cstdint>
#include <numbers>
#include <optional>

#include "base/pose.h"
#include "sim/ball_transport.h"
#include "sim/fresnel.h"

namespace opaline::sim {

/// splitmix64 (Steele et al. 2014) of one path's seed.
class PathNumbers {
 public:
  explicit PathNumbers(std::uint64_t seed) : state_(seed) {}
  double next() {  // in (0, 1)
    std::uint64_t z = state_ += 0x9e3779b97f4a7c15ULL;
    z = (z ^ (z >> 30U)) * 0xbf58476d1ce4e5b9ULL;
    z = (z ^ (z >> 27U)) * 0x94d049bb133111ebULL;
    z ^= z >> 31U;
    return (static_cast<double>(z >> 11U) + 0.5) * 0x1p-53;
  }

 private:
  std::uint64_t state_;
};

/// A path inside a ball about the origin, lengths in transport mean free paths: scatters isotropically with its weight times alpha' a
/// collision, is mirrored by Fresnel's chance, plays for its life below a weight of 0.05, and leaves.
class BallWalk {
 public:
  struct Exit {
    double weight = 0.0;
    Vec3 normal;
    Vec3 way;                    ///< before it refracts
    double cosine_inside = 1.0;  ///< of the angle to the normal, before it refracts
    int collisions = 0;
  };

  explicit BallWalk(const Ball& ball) : ball_(ball) {}

  /// From a point on the surface or inside, along a unit vector that points in. None when absorbed.
  std::optional<Exit> walk(Vec3 at, Vec3 way, double weight, PathNumbers& numbers) const {
    for (int collisions = 0; weight > 0.0;) {
      const double free = -std::log(numbers.next());
      const double out = to_surface(at, way);
      if (free < out) {
        at = at + way * free;
        way = isotropic(numbers);
        weight *= ball_.reduced_albedo;
        ++collisions;
        if (weight < kFaint) weight = numbers.next() < kSurvival ? weight / kSurvival : 0.0;
        continue;
      }
      at = at + way * out;
      const Vec3 normal = at * (1.0 / length(at));
      const double leaving = std::min(1.0, dot(way, normal));
      if (numbers.next() < reflectance(leaving, ball_.ior, 1.0)) {
        way = way + normal * (-2.0 * leaving);
        continue;
      }
      return Exit{weight, normal, way, leaving, collisions};
    }
    return std::nullopt;
  }

 private:
  static constexpr double kFaint = 0.05;  // weight below which a path plays for its life
  static constexpr double kSurvival = 0.25;

  static Vec3 isotropic(PathNumbers& numbers) {
    const double z = 2.0 * numbers.next() - 1.0;
    const double turn = 2.0 * std::numbers::pi * numbers.next();
    const double s = std::sqrt(1.0 - z * z);
    return {s * std::cos(turn), s * std::sin(turn), z};
  }
  double to_surface(Vec3 at, Vec3 way) const {
    const double towards = dot(at, way);
    const double inside = ball_.radius * ball_.radius - dot(at, at);
    const double root = std::sqrt(std::max(0.0, towards * towards + inside));
    return towards > 0.0 ? std::max(0.0, inside) / (root + towards) : root - towards;
  }

  Ball ball_;
};

}  // namespace opaline::sim
