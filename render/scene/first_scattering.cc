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

/// Number k of `count` of place i: a share in the k-th of as many equal strata, and an angle. Where in the stratum, and the angle, differ
/// from place to place as the two coordinates of the R2 sequence do.
struct Spread {
  double share = 0.0;
  double angle = 0.0;
};
Spread spread(std::size_t i, int k, int count) {
  constexpr double kPlastic = 1.32471795724474602596;  // x^3 = x + 1
  const auto f = static_cast<double>(i);
  return {
      (k + fraction(0.5 + f / kPlastic)) / count,
      2.0 * std::numbers::pi * (k / std::numbers::phi + fraction(0.5 + f / (kPlastic * kPlastic)))};
}

Vec3 around_z(double cosine, double angle) {
  const double sine = std::sqrt(std::max(0.0, 1.0 - cosine * cosine));
  return {sine * std::cos(angle), sine * std::sin(angle), cosine};
}

/// The places whose mean integrates what is quadratic in a tetrahedron.
Vec3 gauss_place(const TetMesh& mesh, std::size_t tet, int corner) {
  constexpr double kTowards = 0.4472135955;  // 1 / sqrt(5)
  const Vec3 middle = centroid_of(mesh, tet);
  return middle + (mesh.vertices[mesh.tets[tet][corner]] - middle) * kTowards;
}

/// Follows beam_of(0) to beam_of(count - 1), a share of them in each thread of the team.
template <class BeamOf>
FirstScattering followed(const BeamDeposit& deposit,
                         std::size_t count,
                         const BeamOf& beam_of,
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
    const std::size_t last = count * (thread + 1) / team.size();
    for (std::size_t i = count * thread / team.size(); i < last; ++i) {
      if (stop.stop_requested()) return;
      const InnerBeam beam = beam_of(i);
      if (!(std::ranges::max(beam.power) > 0.0)) continue;
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

}  // namespace

FirstScattering first_scattering(const BeamDeposit& deposit,
                                 std::span<const Beam> beams,
                                 DepositAt where,
                                 ThreadTeam& team,
                                 const std::stop_token& stop) {
  return followed(
      deposit,
      beams.size(),
      [&](std::size_t i) { return deposit.behind(beams[i]); },
      where,
      team,
      stop);
}

FirstScattering next_scattering(const BeamDeposit& deposit,
                                std::span<const std::array<double, 3>> scattered,
                                int directions,
                                DepositAt where,
                                ThreadTeam& team,
                                const std::stop_token& stop) {
  const auto beam_of = [&](std::size_t i) {
    const std::size_t tet = i / directions;
    const auto [share, angle] = spread(tet, static_cast<int>(i % directions), directions);
    InnerBeam beam{.tet = static_cast<int>(tet),
                   .place = gauss_place(deposit.mesh(), tet, static_cast<int>((i + tet) % 4)),
                   .along = around_z(1.0 - 2.0 * share, angle),
                   .power = scattered[tet]};
    for (double& watts : beam.power) watts /= directions;
    return beam;
  };
  return followed(deposit, scattered.size() * directions, beam_of, where, team, stop);
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
      const auto [share, angle] = spread(f, k, directions);
      const Vec3 along = frame.to_scene(around_z(std::sqrt(1.0 - cone.sine_squared(share)), angle));
      beams.push_back({static_cast<int>(f), along, power});
    }
  }
  return beams;
}

}  // namespace opaline::render
