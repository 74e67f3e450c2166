#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <vector>

namespace opaline::reconstruct {

/// The light f(n . omega) that one direction makes leave a surface (stage_correction.h), for many dampings: tables over the cosine, with their integrals over the sphere
/// of f and of f cos. Threads: const, any number.
class LampShapes {
 public:
  explicit LampShapes(double ior);
  /// That of a ratio r = int f / int f cos.
  std::size_t of_ratio(double ratio) const {
    const double damping = std::clamp(0.5 * (ratio / flat_ - 1.0), 0.0, kMostDamping);
    return static_cast<std::size_t>(std::lround(std::sqrt(damping / kMostDamping) * (kShapes - 1)));
  }
  double at(std::size_t shape, double cosine) const {
    const double place = (cosine + 1.0) * (0.5 * kCosines);
    const std::size_t i = step(place);
    const auto& table = tables_[shape];
    return table[i] + (place - static_cast<double>(i)) * (table[i + 1] - table[i]);
  }
  /// Its derivative by the cosine.
  double slope(std::size_t shape, double cosine) const {
    const std::size_t i = step((cosine + 1.0) * (0.5 * kCosines));
    return (tables_[shape][i + 1] - tables_[shape][i]) * (0.5 * kCosines);
  }
  double whole(std::size_t shape) const { return whole_[shape]; }
  double slanted(std::size_t shape) const { return slanted_[shape]; }

 private:
  static constexpr std::size_t kCosines = 1024;  // from -1 to 1
  static constexpr std::size_t kShapes = 64;
  static constexpr double kMostDamping = 2.0;
  static std::size_t step(double place) {
    return std::min(static_cast<std::size_t>(std::max(0.0, place)), kCosines - 1);
  }

  double flat_ = 1.5;
  std::vector<std::array<float, kCosines + 1>> tables_;
  std::array<double, kShapes> whole_{};
  std::array<double, kShapes> slanted_{};
};

}  // namespace opaline::reconstruct
