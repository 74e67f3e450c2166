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
  place_faces();
}

void BeamDeposit::update(const std::vector<Vec3>& vertices, const std::vector<Optics>& optics) {
  mesh_.vertices = vertices;
  optics_ = optics;
  place_faces();
}

void BeamDeposit::place_faces() {
  faces_.clear();
  for (std::size_t t = 0; t < mesh_.tets.size(); ++t) {
    for (int k = 0; k < 4; ++k) {
      if (neighbours_[t][k] >= 0) continue;
      const auto face = face_of(mesh_.tets[t], k);
      const Vec3 a = mesh_.vertices[face[0]];
      const Vec3 b = mesh_.vertices[face[1]];
      const Vec3 c = mesh_.vertices[face[2]];
      const Vec3 n = cross(b - a, c - a);
      neighbours_[t][k] = -1 - static_cast<int>(faces_.size());
      faces_.push_back({{(a + b + c) * (1.0 / 3.0), normalized(n), std::sqrt(length(n))},
                        static_cast<int>(t),
                        0.5 * length(n)});
    }
  }
}

BeamDeposit::Deposit BeamDeposit::step(Walk& walk) const {
  const auto& tet = mesh_.tets[walk.tet];
  std::array<double, 4> here{};  // barycentric coordinates, and how they change along the beam
  std::array<double, 4> slope{};
  double length_left = std::numeric_limits<double>::infinity();
  int out = -1;
  const double volume = 6.0 * volume_of(mesh_, static_cast<std::size_t>(walk.tet));
  for (int k = 0; k < 4; ++k) {
    const auto face = face_of(tet, k);
    const Vec3 a = mesh_.vertices[face[0]];
    const Vec3 n = cross(mesh_.vertices[face[1]] - a, mesh_.vertices[face[2]] - a);
    here[k] = dot(a - walk.place, n) / volume;
    slope[k] = -dot(walk.along, n) / volume;
    if (slope[k] >= 0.0 || k == walk.came_through) continue;
    const double to = std::max(0.0, -here[k] / slope[k]);
    if (to >= length_left) continue;
    length_left = to;
    out = k;
  }
  Deposit deposit{walk.tet, {}, {}};
  if (out < 0) length_left = 0.0;
  double most_left = 0.0;
  for (int c = 0; c < 3; ++c) {
    const Optics& optics = optics_[walk.tet];
    const double t = length_left / (3.0 * optics.diffusion[c]);
    const double scattered = walk.left[c] * -std::expm1(-t);
    const double albedo = 1.0 - 3.0 * optics.diffusion[c] * optics.absorption[c];
    deposit.power[c] = walk.power[c] * albedo * scattered;
    const double at = t > 0.0 ? length_left * centroid(t) : 0.0;
    for (int k = 0; k < 4; ++k)
      deposit.corners[c][k] = std::clamp(here[k] + at * slope[k], 0.0, 1.0);
    walk.left[c] -= scattered;
    if (walk.power[c] > 0.0) most_left = std::max(most_left, walk.left[c]);
  }
  walk.place = walk.place + walk.along * length_left;
  walk.reached = -1;
  if (out < 0 || most_left <= kSpent || ++walk.steps >= kMostSteps) {
    walk.tet = -1;
  } else if (const int beyond = neighbours_[walk.tet][out]; beyond >= 0) {
    const auto& back = neighbours_[beyond];
    walk.came_through = static_cast<int>(std::ranges::find(back, walk.tet) - back.begin());
    walk.tet = beyond;
  } else {
    walk.reached = -1 - beyond;
    walk.came_through = out;
  }
  return deposit;
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
