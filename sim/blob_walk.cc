#include "sim/blob_walk.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace opaline::sim {
namespace {

constexpr double kFaintPath = 0.05;  // weight below which a path plays for its life
constexpr double kPathSurvival = 0.25;

Vec3 any_way(PathNumbers& numbers) {
  const double z = 2.0 * numbers.next() - 1.0;
  const double turn = 2.0 * std::numbers::pi * numbers.next();
  const double s = std::sqrt(1.0 - z * z);
  return {s * std::cos(turn), s * std::sin(turn), z};
}

/// Past a surface whose normal stands against the ray; ratio = index behind / index before. Not for total reflection.
Vec3 refracted(Vec3 way, Vec3 normal, double cosine, double ratio) {
  const double bent = std::sqrt(1.0 - (1.0 - cosine * cosine) / (ratio * ratio));
  return normalized(way * (1.0 / ratio) + normal * (cosine / ratio - bent));
}

}  // namespace

double BlobMaterial::share(Vec3 at) const {
  switch (mixture) {
    case BlobMixture::kNone:
      return 0.0;
    case BlobMixture::kHalves:
      return 0.5 + 0.5 * std::tanh(at.x / blur_mm);
    case BlobMixture::kBands:
      return 0.5 + 0.5 * std::sin(2.0 * std::numbers::pi * at.x / period_mm);
  }
  return 0.0;
}

BlobCoefficients BlobMaterial::at(Vec3 place) const {
  if (mixture == BlobMixture::kNone) return first;
  const double s = share(place);
  const double extinction = (1.0 - s) * first.extinction + s * second.extinction;
  const double scattering = (1.0 - s) * first.extinction * first.reduced_albedo +
                            s * second.extinction * second.reduced_albedo;
  return {extinction, scattering / extinction};
}

BlobWalk::BlobWalk(const Blob& blob, const BlobMaterial& material)
    : blob_(blob),
      material_(material),
      majorant_(material.mixture == BlobMixture::kNone
                    ? material.first.extinction
                    : std::max(material.first.extinction, material.second.extinction)),
      nudge_(1e-6 * blob.shape().radius_mm) {}

void BlobWalk::scatter(State& state, PathNumbers& numbers) const {
  const BlobCoefficients here = material_.at(state.at);
  if (material_.mixture != BlobMixture::kNone && numbers.next() * majorant_ >= here.extinction)
    return;
  state.way = any_way(numbers);
  state.weight *= here.reduced_albedo;
  ++state.collisions;
  if (state.weight < kFaintPath)
    state.weight = numbers.next() < kPathSurvival ? state.weight / kPathSurvival : 0.0;
}

void BlobWalk::reach_surface(State& state, PathNumbers& numbers) const {
  const Vec3 normal = blob_.normal(state.at);
  const double cosine = std::clamp(dot(state.way, normal), 0.0, 1.0);
  if (numbers.next() < reflectance(cosine, material_.ior, 1.0)) {
    state.way = state.way - normal * (2.0 * cosine);
    state.at = state.at - normal * nudge_;
    return;
  }
  state.way = refracted(state.way, normal * -1.0, cosine, 1.0 / material_.ior);
  state.at = state.at + normal * nudge_;
  state.inside = false;
}

/// Whether the path comes back to the body.
bool BlobWalk::go_outside(State& state, PathNumbers& numbers) const {
  const auto met = blob_.meets(state.at, state.way);
  if (!met) return false;
  state.at = state.at + state.way * *met;
  const Vec3 normal = blob_.normal(state.at);
  const double cosine = std::clamp(-dot(state.way, normal), 0.0, 1.0);
  if (numbers.next() < reflectance(cosine, 1.0, material_.ior)) {
    state.way = state.way + normal * (2.0 * cosine);
    state.at = state.at + normal * nudge_;
    return true;
  }
  state.way = refracted(state.way, normal, cosine, material_.ior);
  state.at = state.at - normal * nudge_;
  state.inside = true;
  return true;
}

std::optional<BlobWalk::Origin> BlobWalk::trace(Vec3 surface,
                                                Vec3 normal,
                                                Vec3 to_camera,
                                                PathNumbers& numbers) const {
  const double facing = dot(normal, to_camera);
  if (facing <= 0.0) return std::nullopt;
  State state{surface - normal * nudge_,
              refracted(to_camera * -1.0, normal, facing, material_.ior)};
  state.weight = 1.0 - reflectance(facing, 1.0, material_.ior);
  while (state.weight > 0.0) {
    if (!state.inside) {
      const Vec3 from = state.at;
      if (go_outside(state, numbers)) continue;
      if (state.collisions < 2) return std::nullopt;
      return Origin{state.weight, from, state.way};
    }
    const double free = -std::log(numbers.next()) / majorant_;
    const auto out = blob_.leaves(state.at, state.way, free);
    state.at = state.at + state.way * (out ? *out : free);
    if (out) {
      reach_surface(state, numbers);
    } else {
      scatter(state, numbers);
    }
  }
  return std::nullopt;
}

}  // namespace opaline::sim
