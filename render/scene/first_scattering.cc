#include "render/scene/first_scattering.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "base/ensure.h"
#include "reconstruct/diffusion/fresnel.h"
#include "render/scene/lighting.h"

namespace opaline::render {
namespace {

constexpr int kConeSteps = 256;

using Power = std::vector<std::array<double, 3>>;

void add(std::array<double, 3>& sum, const std::array<double, 3>& power) {
  for (int c = 0; c < 3; ++c) sum[c] += power[c];
}

void add(Power& sums, const Power& more) {
  for (std::size_t i = 0; i < sums.size(); ++i) add(sums[i], more[i]);
}

double fraction(double x) { return x - std::floor(x); }

/// Direction k of `count` behind a face, about +z, in the k-th of as many equal shares of the cone.
/// Where in the share, and the angle about z, differ from face to face as the two coordinates of the R2 sequence do.
Vec3 direction_behind(const RefractedCone& cone, std::size_t face, int k, int count) {
  constexpr double kPlastic = 1.32471795724474602596;  // x^3 = x + 1
  const auto f = static_cast<double>(face);
  const double square = cone.sine_squared((k + fraction(0.5 + f / kPlastic)) / count);
  const double angle =
      2.0 * std::numbers::pi * (k / std::numbers::phi + fraction(0.5 + f / (kPlastic * kPlastic)));
  const double sine = std::sqrt(square);
  return {sine * std::cos(angle), sine * std::sin(angle), std::sqrt(1.0 - square)};
}

}  // namespace

FirstScattering first_scattering(const BeamDeposit& deposit,
                                 std::span<const Beam> beams,
                                 DepositAt where,
                                 ThreadTeam& team,
                                 const std::stop_token& stop) {
  const TetMesh& mesh = deposit.mesh();
  const bool at_vertices = where == DepositAt::kVertices;
  const std::size_t nodes = at_vertices ? mesh.vertices.size() : mesh.tets.size();
  std::vector<FirstScattering> parts(static_cast<std::size_t>(team.size()));
  team.run([&](int thread) {
    FirstScattering& part = parts[static_cast<std::size_t>(thread)];
    part = {Power(nodes), Power(deposit.faces().size())};
    const std::size_t first = beams.size() * thread / team.size();
    const std::size_t last = beams.size() * (thread + 1) / team.size();
    for (const Beam& beam : beams.subspan(first, last - first)) {
      if (stop.stop_requested()) return;
      deposit.follow(
          beam,
          [&](const BeamDeposit::Deposit& d) {
            if (!at_vertices) return add(part.scattered[d.tet], d.power);
            for (int k = 0; k < 4; ++k) {
              std::array<double, 3>& sum = part.scattered[mesh.tets[d.tet][k]];
              for (int c = 0; c < 3; ++c) sum[c] += d.corners[c][k] * d.power[c];
            }
          },
          [&](int face, const std::array<double, 3>& power) { add(part.passed[face], power); });
    }
  });
  for (std::size_t p = 1; p < parts.size(); ++p) {
    add(parts[0].scattered, parts[p].scattered);
    add(parts[0].passed, parts[p].passed);
  }
  return std::move(parts[0]);
}

RefractedCone::RefractedCone(double ior) : ior_(ior), shares_(kConeSteps + 1, 0.0) {
  double sum = 0.0;
  for (int k = 0; k < kConeSteps; ++k) {
    const double cosine = std::sqrt(1.0 - (k + 0.5) / kConeSteps);
    sum += 1.0 - reconstruct::diffusion::fresnel_reflectance(cosine, ior);
    shares_[k + 1] = sum;
  }
  for (double& share : shares_) share /= sum;
}

double RefractedCone::sine_squared(double share) const {
  const auto above = std::upper_bound(shares_.begin() + 1, shares_.end() - 1, share);
  const double step = static_cast<double>(above - shares_.begin() - 1) +
                      (share - *(above - 1)) / (*above - *(above - 1));
  return step / (kConeSteps * ior_ * ior_);
}

std::vector<Beam> diffuse_beams(const BeamDeposit& deposit,
                                std::span<const std::array<float, 3>> q,
                                int directions) {
  ENSURE(q.size() == deposit.faces().size());
  const RefractedCone cone(deposit.ior());
  std::vector<Beam> beams;
  for (std::size_t f = 0; f < q.size(); ++f) {
    if (!(std::ranges::max(q[f]) > 0.0F)) continue;
    const BeamDeposit::Face& face = deposit.faces()[f];
    const Frame frame = frame_around(face.middle.normal * -1.0);
    std::array<double, 3> power{};
    for (int c = 0; c < 3; ++c) power[c] = q[f][c] * face.area / directions;
    for (int k = 0; k < directions; ++k) {
      const Vec3 along = frame.to_scene(direction_behind(cone, f, k, directions));
      beams.push_back({static_cast<int>(f), along, power});
    }
  }
  return beams;
}

}  // namespace opaline::render
