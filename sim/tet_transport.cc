#include "sim/tet_transport.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <numeric>
#include <thread>

#include "sim/fresnel.h"
#include "sim/photon_lanes.h"

namespace opaline::sim {
namespace {

constexpr int kBatches = 64;
constexpr double kDim = 1e-3;      // a photon's weight below which chance decides
constexpr double kSurvives = 0.1;  // then
constexpr int kMostFlights = 1'000'000;

struct Plane {
  Vec3 normal;  // outwards
  double offset = 0.0;
  int beyond = -1;   // tetrahedron, or -1
  int surface = -1;  // face number
};

/// Planes of all tetrahedra, joined at their faces.
class PlaneTable {
 public:
  explicit PlaneTable(const TetSolid& solid) : planes_(solid.tets.size()) {
    std::map<std::array<int, 3>, std::pair<int, int>> waiting;
    for (int t = 0; t < static_cast<int>(solid.tets.size()); ++t) {
      for (int k = 0; k < 4; ++k) {
        std::array<int, 3> corners = others(solid.tets[t], k);
        planes_[t][k] = plane(solid, t, k, corners);
        std::ranges::sort(corners);
        const auto [place, fresh] = waiting.try_emplace(corners, t, k);
        if (fresh) continue;
        const auto [other, opposite] = place->second;
        planes_[t][k].beyond = other;
        planes_[other][opposite].beyond = t;
        waiting.erase(place);
      }
    }
    for (int t = 0; t < static_cast<int>(planes_.size()); ++t) {
      for (int k = 0; k < 4; ++k) {
        if (planes_[t][k].beyond >= 0) continue;
        planes_[t][k].surface = static_cast<int>(faces_.size());
        faces_.push_back({t, k});
      }
    }
  }
  const std::array<Plane, 4>& operator[](int tet) const { return planes_[tet]; }
  const std::vector<TetFace>& faces() const { return faces_; }

  static std::array<int, 3> others(const std::array<int, 4>& tet, int k) {
    return {tet[(k + 1) % 4], tet[(k + 2) % 4], tet[(k + 3) % 4]};
  }

 private:
  static Plane plane(const TetSolid& solid, int t, int k, const std::array<int, 3>& corners) {
    const Vec3 a = solid.vertices[corners[0]];
    Vec3 n = normalized(cross(solid.vertices[corners[1]] - a, solid.vertices[corners[2]] - a));
    if (dot(solid.vertices[solid.tets[t][k]] - a, n) > 0.0) n = n * -1.0;
    return {n, dot(n, a)};
  }

  std::vector<std::array<Plane, 4>> planes_;
  std::vector<TetFace> faces_;
};

struct Photon {
  Vec3 place;
  Vec3 along;
  int tet = 0;
  double weight = 1.0;
  bool collided = false;
};

struct Sums {
  std::vector<double> left;
  std::vector<double> first;  // empty where it is not counted
  double absorbed = 0.0;
  double unscattered = 0.0;
};

Vec3 across(Vec3 n) {
  return normalized(cross(n, std::abs(n.x) < 0.6 ? Vec3{1.0, 0.0, 0.0} : Vec3{0.0, 1.0, 0.0}));
}

Vec3 around(Vec3 axis, double cosine, double azimuth) {
  const Vec3 x = across(axis);
  const Vec3 y = cross(axis, x);
  const double sine = std::sqrt(std::max(0.0, 1.0 - cosine * cosine));
  return axis * cosine + x * (sine * std::cos(azimuth)) + y * (sine * std::sin(azimuth));
}

class Tracer {
 public:
  Tracer(const TetSolid& solid,
         const PlaneTable& planes,
         std::span<const double> power,
         std::span<const int> patch,
         const TetTransportOptions& options)
      : solid_(solid), planes_(planes), patch_(patch), options_(options) {
    cumulative_.resize(power.size());
    std::partial_sum(power.begin(), power.end(), cumulative_.begin());
  }

  void trace(SplitMix& random, Sums& sums) const {
    Photon photon = entering(random);
    for (int flight = 0; flight < kMostFlights && photon.weight > 0.0; ++flight) {
      fly(photon, random, sums);
      if (photon.weight < kDim) {
        const bool lives = random.uniform() < kSurvives;
        photon.weight = lives ? photon.weight / kSurvives : 0.0;
      }
    }
  }

 private:
  Photon entering(SplitMix& random) const {
    const double chosen = random.uniform() * cumulative_.back();
    const auto found = std::ranges::upper_bound(cumulative_, chosen);
    const auto face = std::min<std::size_t>(found - cumulative_.begin(), cumulative_.size() - 1);
    const auto [tet, opposite] = planes_.faces()[face];
    const auto corners = PlaneTable::others(solid_.tets[tet], opposite);
    const double root = std::sqrt(random.uniform());
    const double share = random.uniform();
    Photon photon;
    photon.tet = tet;
    photon.place = solid_.vertices[corners[0]] * (1.0 - root) +
                   solid_.vertices[corners[1]] * (root * (1.0 - share)) +
                   solid_.vertices[corners[2]] * (root * share);
    photon.along = entry_direction(planes_[tet][opposite].normal, random);
    return photon;
  }

  Vec3 entry_direction(Vec3 normal, SplitMix& random) const {
    const Vec3 inwards = normal * -1.0;
    if (options_.entry == TetEntry::kDiffuse) {
      const double sine_squared = passing_sine_squared(random) / (solid_.ior * solid_.ior);
      return around(
          inwards, std::sqrt(1.0 - sine_squared), 2.0 * std::numbers::pi * random.uniform());
    }
    const Vec3 d = normalized(options_.direction);
    const double cosine = dot(d, inwards);
    const Vec3 tangent = (d - inwards * cosine) * (1.0 / solid_.ior);
    return normalized(tangent + inwards * std::sqrt(std::max(0.0, 1.0 - dot(tangent, tangent))));
  }

  /// Outside: of light from everywhere that is not mirrored.
  double passing_sine_squared(SplitMix& random) const {
    double cosine_squared = random.uniform();
    while (solid_.ior != 1.0 &&
           random.uniform() < reflectance(std::sqrt(cosine_squared), 1.0, solid_.ior)) {
      cosine_squared = random.uniform();
    }
    return 1.0 - cosine_squared;
  }

  /// From one collision, or the surface, to the next.
  void fly(Photon& photon, SplitMix& random, Sums& sums) const {
    double depth = -std::log1p(-random.uniform());
    for (int crossed = 0; crossed < kMostFlights; ++crossed) {
      const Plane* out = nullptr;
      double distance = std::numeric_limits<double>::infinity();
      for (const Plane& plane : planes_[photon.tet]) {
        const double speed = dot(plane.normal, photon.along);
        if (speed <= 0.0) continue;
        const double to = std::max(0.0, (plane.offset - dot(plane.normal, photon.place)) / speed);
        if (to >= distance) continue;
        distance = to;
        out = &plane;
      }
      const double scattering = solid_.scattering[photon.tet];
      if (out == nullptr || depth < scattering * distance) {
        const double flown = out == nullptr ? 0.0 : depth / scattering;
        advance(photon, flown, sums);
        if (!photon.collided && !sums.first.empty()) sums.first[photon.tet] += photon.weight;
        photon.collided = true;
        photon.along = around({0.0, 0.0, 1.0},
                              2.0 * random.uniform() - 1.0,
                              2.0 * std::numbers::pi * random.uniform());
        return;
      }
      depth -= scattering * distance;
      advance(photon, distance, sums);
      if (out->beyond >= 0) {
        photon.tet = out->beyond;
      } else if (!reflected(photon, *out, random, sums)) {
        return;
      }
    }
  }

  void advance(Photon& photon, double distance, Sums& sums) const {
    photon.place = photon.place + photon.along * distance;
    const double kept = photon.weight * std::exp(-solid_.absorption[photon.tet] * distance);
    sums.absorbed += photon.weight - kept;
    photon.weight = kept;
  }

  bool reflected(Photon& photon, const Plane& out, SplitMix& random, Sums& sums) const {
    const double cosine = std::min(1.0, dot(out.normal, photon.along));
    if (solid_.ior != 1.0 && random.uniform() < reflectance(cosine, solid_.ior, 1.0)) {
      photon.along = photon.along - out.normal * (2.0 * cosine);
      return true;
    }
    if (!photon.collided) sums.unscattered += photon.weight;
    if ((photon.collided || options_.count_unscattered) && is_seen(photon.along, out.normal))
      sums.left[patch_[out.surface]] += photon.weight;
    photon.weight = 0.0;
    return false;
  }

  /// Whether what arrives along a direction leaves within the angle of what is tallied (Snell).
  bool is_seen(Vec3 along, Vec3 normal) const {
    if (options_.seen_cosine <= -1.0) return true;
    const Vec3 tangent = (along - normal * dot(along, normal)) * solid_.ior;
    const Vec3 outside = tangent + normal * std::sqrt(std::max(0.0, 1.0 - dot(tangent, tangent)));
    return dot(outside, normalized(options_.seen)) >= options_.seen_cosine;
  }

  const TetSolid& solid_;
  const PlaneTable& planes_;
  std::span<const int> patch_;
  const TetTransportOptions& options_;
  std::vector<double> cumulative_;
};

Result<void> check(const TetSolid& solid,
                   const PlaneTable& planes,
                   std::span<const double> power,
                   std::span<const int> patch,
                   const TetTransportOptions& options) {
  const std::size_t count = solid.tets.size();
  if (solid.absorption.size() != count || solid.scattering.size() != count) {
    return invalid_argument("expected one absorption and scattering a tetrahedron");
  }
  for (std::size_t t = 0; t < count; ++t) {
    if (!(solid.absorption[t] >= 0.0) || !(solid.scattering[t] >= 0.0)) {
      return invalid_argument(
          fmt::format("tetrahedron {}: expected coefficients of at least 0", t));
    }
  }
  if (!(solid.ior >= 1.0)) return invalid_argument("ior: expected at least 1");
  if (power.size() != planes.faces().size() || patch.size() != power.size()) {
    return invalid_argument(
        fmt::format("expected power and patch of {} faces", planes.faces().size()));
  }
  if (!(std::accumulate(power.begin(), power.end(), 0.0) > 0.0)) {
    return invalid_argument("no light enters");
  }
  if (std::ranges::min(patch) < 0) return invalid_argument("patches: expected numbers from 0");
  if (options.photons < kBatches || options.threads < 1) {
    return invalid_argument(fmt::format("expected at least {} photons and a thread", kBatches));
  }
  return ok();
}

TetTransportResult summed(const std::vector<Sums>& batches, std::uint64_t photons_of_batch) {
  TetTransportResult result;
  const std::size_t patches = batches[0].left.size();
  const auto scale = 1.0 / static_cast<double>(photons_of_batch);
  const auto count = static_cast<double>(batches.size());
  result.left.resize(patches);
  result.standard_error.resize(patches);
  for (std::size_t p = 0; p < patches; ++p) {
    double sum = 0.0;
    double squares = 0.0;
    for (const Sums& batch : batches) {
      const double value = batch.left[p] * scale;
      sum += value;
      squares += value * value;
    }
    result.left[p] = sum / count;
    const double variance = std::max(0.0, squares / count - result.left[p] * result.left[p]);
    result.standard_error[p] = std::sqrt(variance / (count - 1.0));
  }
  result.first.resize(batches[0].first.size());
  for (const Sums& batch : batches) {
    for (std::size_t t = 0; t < result.first.size(); ++t)
      result.first[t] += batch.first[t] * scale / count;
    result.absorbed += batch.absorbed * scale / count;
    result.unscattered += batch.unscattered * scale / count;
  }
  return result;
}

}  // namespace

std::vector<TetFace> surface_faces(const TetSolid& solid) { return PlaneTable(solid).faces(); }

Result<TetTransportResult> trace_tets(const TetSolid& solid,
                                      std::span<const double> power,
                                      std::span<const int> patch,
                                      const TetTransportOptions& options,
                                      std::stop_token stop) {
  const PlaneTable planes(solid);
  if (auto good = check(solid, planes, power, patch, options); !good) return good.error();
  const Tracer tracer(solid, planes, power, patch, options);
  const std::uint64_t photons = options.photons / kBatches;
  const auto patches = static_cast<std::size_t>(std::ranges::max(patch)) + 1;
  std::vector<Sums> batches(kBatches);
  std::atomic<int> next{0};
  {
    std::vector<std::jthread> threads;
    threads.reserve(options.threads);
    for (int t = 0; t < options.threads; ++t) {
      threads.emplace_back([&] {
        for (int b = next++; b < kBatches; b = next++) {
          batches[b].left.resize(patches);
          if (options.count_first) batches[b].first.resize(solid.tets.size());
          SplitMix seeds(options.seed * kBatches + static_cast<std::uint64_t>(b));
          SplitMix random(seeds.next());
          for (std::uint64_t k = 0; k < photons && !stop.stop_requested(); ++k) {
            tracer.trace(random, batches[b]);
          }
        }
      });
    }
  }
  if (stop.stop_requested()) return cancelled("tracing light");
  return summed(batches, photons);
}

}  // namespace opaline::sim
