#include "render/scene/beam_deposit.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "reconstruct/diffusion/fresnel.h"

namespace opaline::render {
namespace {

constexpr double kSpent = 1e-4;
constexpr int kMostSteps = 10'000;

/// Where along t scattering happens on average, as a share of it: 1/t - 1/(e^t - 1).
double centroid(double t) { return t < 1e-3 ? 0.5 - t / 12.0 : 1.0 / t - 1.0 / std::expm1(t); }

}  // namespace

BeamDeposit::BeamDeposit(TetMesh mesh, std::vector<Optics> optics, double ior)
    : mesh_(std::move(mesh)),
      optics_(std::move(optics)),
      ior_(ior),
      neighbours_(neighbours_of(mesh_)) {
  place_corners();
}

void BeamDeposit::update(const std::vector<Vec3>& vertices, const std::vector<Optics>& optics) {
  mesh_.vertices = vertices;
  optics_ = optics;
  place_corners();
}

void BeamDeposit::place_corners() {
  faces_.clear();
  corners_.resize(mesh_.tets.size());
  for (std::size_t t = 0; t < mesh_.tets.size(); ++t) {
    const double volume = 6.0 * volume_of(mesh_, t);
    for (int k = 0; k < 4; ++k) {
      const auto face = face_of(mesh_.tets[t], k);
      const Vec3 a = mesh_.vertices[face[0]];
      const Vec3 b = mesh_.vertices[face[1]];
      const Vec3 c = mesh_.vertices[face[2]];
      const Vec3 n = cross(b - a, c - a);
      corners_[t][k] = {n * (-1.0 / volume), dot(a, n) / volume};
      if (neighbours_[t][k] >= 0) continue;
      neighbours_[t][k] = -1 - static_cast<int>(faces_.size());
      faces_.push_back({{(a + b + c) * (1.0 / 3.0), normalized(n), std::sqrt(length(n))},
                        static_cast<int>(t),
                        0.5 * length(n)});
    }
  }
}

BeamDeposit::Crossing BeamDeposit::cross_tet(const Walk& walk) const {
  Crossing crossing;
  crossing.length = std::numeric_limits<double>::infinity();
  for (int k = 0; k < 4; ++k) {
    const auto& [gradient, offset] = corners_[walk.tet][k];
    crossing.here[k] = dot(gradient, walk.place) + offset;
    crossing.slope[k] = dot(gradient, walk.along);
    if (crossing.slope[k] >= 0.0 || k == walk.came_through) continue;
    const double to = std::max(0.0, -crossing.here[k] / crossing.slope[k]);
    if (to >= crossing.length) continue;
    crossing.length = to;
    crossing.out = k;
  }
  if (crossing.out < 0) crossing.length = 0.0;
  return crossing;
}

BeamDeposit::Deposit BeamDeposit::step(Walk& walk) const {
  Crossing crossing = cross_tet(walk);
  const double longest = walk.deepest_step * 3.0 * std::ranges::min(optics_[walk.tet].diffusion);
  crossing.stays = crossing.length > longest;
  if (crossing.stays) crossing.length = longest;
  Deposit deposit{walk.tet, {}, {}};
  double most_left = 0.0;
  for (int c = 0; c < 3; ++c) {
    const Optics& optics = optics_[walk.tet];
    const double t = crossing.length / (3.0 * optics.diffusion[c]);
    const double scattered = walk.left[c] * -std::expm1(-t);
    const double albedo = 1.0 - 3.0 * optics.diffusion[c] * optics.absorption[c];
    deposit.power[c] = walk.power[c] * albedo * scattered;
    const double at = t > 0.0 ? crossing.length * centroid(t) : 0.0;
    for (int k = 0; k < 4; ++k) {
      deposit.corners[c][k] = std::clamp(crossing.here[k] + at * crossing.slope[k], 0.0, 1.0);
    }
    walk.left[c] -= scattered;
    if (walk.power[c] > 0.0) most_left = std::max(most_left, walk.left[c]);
  }
  go_on(walk, crossing, most_left <= kSpent);
  return deposit;
}

void BeamDeposit::go_on(Walk& walk, const Crossing& crossing, bool is_spent) const {
  walk.place = walk.place + walk.along * crossing.length;
  walk.reached = -1;
  if (crossing.out < 0 || is_spent || ++walk.steps >= kMostSteps) {
    walk.tet = -1;
  } else if (crossing.stays) {
    return;
  } else if (const int beyond = neighbours_[walk.tet][crossing.out]; beyond >= 0) {
    const auto& back = neighbours_[beyond];
    walk.came_through = static_cast<int>(std::ranges::find(back, walk.tet) - back.begin());
    walk.tet = beyond;
  } else {
    walk.reached = -1 - beyond;
    walk.came_through = crossing.out;
  }
}

BeamDeposit::WayOut BeamDeposit::way_out(int tet, Vec3 place, Vec3 along) const {
  static const double most = -std::log(kSpent);
  Walk walk{.along = along, .place = place, .tet = tet};
  std::array<double, 3> depth{};
  while (walk.tet >= 0 && walk.reached < 0) {
    const Crossing crossing = cross_tet(walk);
    for (int c = 0; c < 3; ++c) {
      depth[c] += crossing.length / (3.0 * optics_[walk.tet].diffusion[c]);
    }
    go_on(walk, crossing, std::ranges::min(depth) >= most);
  }
  WayOut out{walk.reached, walk.place, {}};
  for (int c = 0; c < 3; ++c) out.left[c] = std::exp(-depth[c]);
  return out;
}

std::array<double, 3> BeamDeposit::mirror(Walk& walk) const {
  const Vec3 normal = faces_[walk.reached].middle.normal;
  const double cosine = std::clamp(dot(walk.along, normal), 0.0, 1.0);
  const double kept = reconstruct::diffusion::fresnel_reflectance(cosine, 1.0 / ior_);
  std::array<double, 3> gone{};
  for (int c = 0; c < 3; ++c) {
    gone[c] = walk.power[c] * walk.left[c] * (1.0 - kept);
    walk.left[c] *= kept;
  }
  walk.along = walk.along - normal * (2.0 * cosine);
  if (std::ranges::max(walk.left) <= kSpent) walk.tet = -1;
  return gone;
}

}  // namespace opaline::render
