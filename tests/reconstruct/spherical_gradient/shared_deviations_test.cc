#include "reconstruct/spherical_gradient/shared_deviations.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

#include "base/light_sphere.h"

namespace opaline::reconstruct {
namespace {

constexpr int kLamps = 346;
constexpr int kDraws = 2'000;
constexpr double kOfOne = 0.01;
constexpr double kStep = 1e-3;  // of the normal, for its divergence

struct Seen {
  double constant = 0.0;
  double ratio = 0.0;
  double curvature = 0.0;  // of the unit ball
};

/// The signed pictures of a cosine surface, lamp after lamp.
class Ball {
 public:
  explicit Ball(std::vector<double> intensities) : intensities_(std::move(intensities)) {}
  Seen at(Vec3 n) const {
    const Vec3 vector = gradients(n);
    double constant = 0.0;
    for (std::size_t i = 0; i < lamps_.size(); ++i)
      constant += intensities_[i] * std::max(0.0, dot(lamps_[i], n));
    const Vec3 across = normalized(cross(n, {0.3, 0.5, -0.8}));
    double divergence = 0.0;
    for (const Vec3 along : {across, cross(n, across)}) {
      const Vec3 ahead = normalized(gradients(normalized(n + along * kStep)));
      const Vec3 behind = normalized(gradients(normalized(n - along * kStep)));
      divergence += dot(ahead - behind, along) / (2.0 * kStep);
    }
    return {constant, constant / length(vector), 0.5 * divergence};
  }

 private:
  Vec3 gradients(Vec3 n) const {
    Vec3 sum{};
    for (std::size_t i = 0; i < lamps_.size(); ++i)
      sum = sum + lamps_[i] * (intensities_[i] * std::max(0.0, dot(lamps_[i], n)));
    return sum;
  }
  std::vector<Vec3> lamps_ = light_sphere_directions(kLamps);
  std::vector<double> intensities_;
};

// The lamps of a real sphere are not quite all around, and a variance of 2000 draws is known to 3 %.
TEST(SharedDeviations, AreWhatDrawnLampsDo) {
  const Ball believed(std::vector<double>(kLamps, 1.0));
  const std::vector<Vec3> normals{{0, 0, 1},
                                  normalized({0.5, 0.2, 0.8}),
                                  normalized({-0.6, 0.6, 0.4}),
                                  normalized({0, 0.9, 0.3})};
  std::mt19937 random(5);
  std::normal_distribution<double> error(0.0, kOfOne);
  double ratio = 0.0;
  double reflectance = 0.0;
  double curvature = 0.0;
  for (int draw = 0; draw < kDraws; ++draw) {
    std::vector<double> intensities;
    for (int lamp = 0; lamp < kLamps; ++lamp) intensities.push_back(1.0 + error(random));
    const Ball drawn(std::move(intensities));
    for (const Vec3 n : normals) {
      const Seen is = drawn.at(n);
      const Seen should = believed.at(n);
      const double weight = 1.0 / (kDraws * static_cast<double>(normals.size()));
      ratio += weight * std::pow(is.ratio / should.ratio - 1.0, 2);
      reflectance += weight * std::pow(is.constant / should.constant - 1.0, 2);
      curvature += weight * std::pow(is.curvature / should.curvature - 1.0, 2);
    }
  }

  const SharedDeviations stated = shared_deviations(kOfOne, kLamps, 0.0);

  EXPECT_NEAR(stated.ratio / std::sqrt(ratio), 1.0, 0.05);
  EXPECT_NEAR(stated.reflectance / std::sqrt(reflectance), 1.0, 0.05);
  EXPECT_NEAR(stated.curvature / std::sqrt(curvature), 1.0, 0.05);
  EXPECT_NEAR(shared_deviations(0.0, kLamps, 0.02).reflectance, 0.02, 1e-15);
}

}  // namespace
}  // namespace opaline::reconstruct
