#include "reconstruct/diffusion/half_space.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <utility>

#include "base/ensure.h"
#include "reconstruct/diffusion/fresnel.h"
#include "reconstruct/diffusion/quadrature.h"

namespace opaline::reconstruct::diffusion {
namespace {

constexpr int kPanels = 2;  // of 8 nodes, on either side of the critical cosine
constexpr int kHalvings = 100;
constexpr double kLeastAlbedo = 0.01;
constexpr double kLeastAbsorption = 1e-9;

// x (3 - 2 x) x crowds nodes at both ends, where J is not smooth.
std::vector<std::pair<double, double>> crowded_nodes(double begin, double end) {
  std::vector<std::pair<double, double>> nodes;
  for_gauss_nodes(kPanels, [&](double x, double weight) {
    nodes.emplace_back(begin + (end - begin) * x * x * (3.0 - 2.0 * x),
                       (end - begin) * 6.0 * x * (1.0 - x) * weight);
  });
  return nodes;
}

}  // namespace

HalfSpace::HalfSpace(double ior) {
  ENSURE(ior >= 1.0);
  const double critical = std::sqrt(1.0 - 1.0 / (ior * ior));
  auto nodes = crowded_nodes(critical, 1.0);
  if (critical > 0.0)
    for (const auto& node : crowded_nodes(0.0, critical)) nodes.push_back(node);
  std::ranges::sort(nodes, std::greater());
  for (const auto& [cosine, weight] : nodes) {
    cosine_.push_back(cosine);
    weight_.push_back(weight);
    reflectance_.push_back(fresnel_reflectance(cosine, 1.0 / ior));
  }
}

std::vector<double> HalfSpace::modes(double albedo) const {
  const auto above = [&](double lambda) {
    double sum = 0.0;
    for (std::size_t i = 0; i < cosine_.size(); ++i)
      sum += weight_[i] / (1.0 - std::pow(lambda * cosine_[i], 2));
    return albedo * sum > 1.0;
  };
  std::vector<double> roots;
  double low = 0.0;
  for (const double cosine : cosine_) {
    double begin = low;
    double end = 1.0 / cosine;
    for (int n = 0; n < kHalvings; ++n) {
      const double middle = 0.5 * (begin + end);
      (above(middle) ? end : begin) = middle;
    }
    roots.push_back(0.5 * (begin + end));
    low = 1.0 / cosine;
  }
  return roots;
}

double HalfSpace::emergent(double albedo, double inside_cosine) const {
  ENSURE(inside_cosine > 0.0);
  const double c = std::clamp(albedo, kLeastAlbedo, 1.0 - kLeastAbsorption);
  const std::vector<double> lambda = modes(c);
  double driven = 0.0;
  for (std::size_t i = 0; i < cosine_.size(); ++i)
    driven += c * weight_[i] / (1.0 - cosine_[i] * cosine_[i]);
  const double beam = 1.0 / (1.0 - driven);  // 1 + the fluence that goes as e^(-tau)
  const auto n = static_cast<Eigen::Index>(cosine_.size());
  Eigen::MatrixXd condition(n, n);
  Eigen::VectorXd right(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const double mu = cosine_[static_cast<std::size_t>(i)];
    const double r = reflectance_[static_cast<std::size_t>(i)];
    for (Eigen::Index k = 0; k < n; ++k) {
      const double l = lambda[static_cast<std::size_t>(k)];
      condition(i, k) = 1.0 / (1.0 - l * mu) - r / (1.0 + l * mu);
    }
    right(i) = -beam * (1.0 / (1.0 - mu) - r / (1.0 + mu));
  }
  const Eigen::VectorXd strength = condition.partialPivLu().solve(right);
  double seen = beam / (1.0 + inside_cosine);
  for (Eigen::Index k = 0; k < n; ++k)
    seen += strength(k) / (1.0 + lambda[static_cast<std::size_t>(k)] * inside_cosine);
  return c * seen;
}

}  // namespace opaline::reconstruct::diffusion
