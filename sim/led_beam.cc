#include "sim/led_beam.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <numbers>
#include <optional>
#include <thread>

#include "base/thread_team.h"
#include "sim/hash.h"

namespace opaline::sim {
namespace {

constexpr int kPathGroups = 64;  // of paths, summed in an order that does not depend on the threads
constexpr double kSamePlace = 4.0;  // pixels between where a path leaves and what its pixel sees

struct Leaving {
  Vec3 point;
  double weight = 0.0;
};

/// Paths of one channel from where the beam enters.
class BeamWalk {
 public:
  BeamWalk(const LedTruth& truth, const ObjectTruth& entry, Vec3 way, std::size_t channel)
      : truth_(truth), entry_(entry), way_(way), material_(truth.material(channel)) {
    if (truth.blob()) walk_.emplace(*truth.blob(), material_);
  }
  std::optional<Leaving> trace(PathNumbers& numbers) const {
    if (!walk_) return in_ball(numbers);
    const auto origin = walk_->trace(entry_.point, entry_.normal, way_ * -1.0, numbers);
    if (!origin) return std::nullopt;
    return Leaving{origin->from, origin->weight};
  }

 private:
  std::optional<Leaving> in_ball(PathNumbers& numbers) const {
    const double extinction = material_.first.extinction;
    const double radius = truth_.radius_mm(entry_.object);
    const double cosine = std::clamp(-dot(way_, entry_.normal), 0.0, 1.0);
    const double ratio = 1.0 / material_.ior;
    const double bent = std::sqrt(1.0 - (1.0 - cosine * cosine) * ratio * ratio);
    const Vec3 inward = normalized(way_ * ratio + entry_.normal * (cosine * ratio - bent));
    const BallWalk walk({material_.first.reduced_albedo, radius * extinction, material_.ior});
    const auto exit = walk.walk(entry_.normal * (radius * extinction),
                                inward,
                                1.0 - reflectance(cosine, 1.0, material_.ior),
                                numbers);
    if (!exit || exit->collisions < 2) return std::nullopt;
    return Leaving{entry_.point + (exit->normal - entry_.normal) * radius, exit->weight};
  }

  const LedTruth& truth_;
  const ObjectTruth& entry_;
  Vec3 way_;
  BlobMaterial material_;
  std::optional<BlobWalk> walk_;
};

/// Radiance over exitance / pi of light that arrives evenly below the surface.
double even_law(double cosine, double ior) {
  constexpr int kSteps = 500;
  double mean = 0.0;
  for (int n = 0; n < kSteps; ++n) {
    const double mu = (n + 0.5) / kSteps;
    mean += 2.0 * mu * (1.0 - reflectance(mu, 1.0, ior)) / kSteps;
  }
  return (1.0 - reflectance(cosine, 1.0, ior)) / mean;
}

/// Weights by pixel, of paths that leave where their pixel looks.
using Weights = std::map<std::uint32_t, double>;

class Catcher {
 public:
  Catcher(const LedTruth& truth, const CameraModel& camera) : truth_(truth), camera_(camera) {}

  void add(const Leaving& leaving, Weights& weights) const {
    if (!camera_.faces(leaving.point)) return;
    const CameraModel::Pixel at = camera_.project(leaving.point);
    const int x = static_cast<int>(std::floor(at.x));
    const int y = static_cast<int>(std::floor(at.y));
    if (x < 0 || y < 0 || x >= camera_.width || y >= camera_.height) return;
    const auto seen = truth_.at(camera_, x + 0.5, y + 0.5);
    if (!seen) return;
    const double far = length(seen->point - camera_.centre());
    if (length(seen->point - leaving.point) > kSamePlace * far / camera_.fx) return;
    weights[static_cast<std::uint32_t>(y * camera_.width + x)] += leaving.weight;
  }
  /// Radiance of a pixel over power that leaves towards it.
  double radiance(std::uint32_t pixel, double ior) const {
    const int row = static_cast<int>(pixel) / camera_.width;
    const int column = static_cast<int>(pixel) % camera_.width;
    const auto seen = truth_.at(camera_, column + 0.5, row + 0.5);
    if (!seen) return 0.0;
    const Vec3 to = camera_.centre() - seen->point;
    const double cosine = std::max(0.05, dot(seen->normal, to) / length(to));
    const double area = dot(to, to) / (camera_.fx * camera_.fy * cosine);
    return even_law(cosine, ior) / (std::numbers::pi * area);
  }

 private:
  const LedTruth& truth_;
  CameraModel camera_;
};

}  // namespace

Result<BeamLight> BeamLight::trace(const LedSphereOptions& options,
                                   const CameraOptics& camera,
                                   EventSink& events,
                                   std::stop_token stop) {
  BeamLight light;
  if (!options.beam) return light;
  const LedBeam& beam = *options.beam;
  const auto truth = LedTruth::create(options);
  if (!truth) return truth.error();
  const Vec3 way = normalized(beam.aim - beam.from);
  const auto entry = truth->along(beam.from, way);
  if (!entry) return invalid_argument("the beam misses the object: light_stage.beam.aim_mm");
  const Catcher catcher(*truth, camera.model);
  ThreadTeam team(static_cast<int>(std::max(1U, std::thread::hardware_concurrency())));
  std::map<std::uint32_t, Rgb> sums;
  for (std::size_t c = 0; c < 3; ++c) {
    const BeamWalk walk(*truth, *entry, way, c);
    std::vector<Weights> groups(kPathGroups);
    team.run([&](int thread) {
      for (int group = thread; group < kPathGroups; group += team.size()) {
        PathNumbers numbers(mix(mix(options.seed, 0x6265616d + c), static_cast<unsigned>(group)));
        for (std::int64_t n = 0; n < beam.paths / kPathGroups && !stop.stop_requested(); ++n)
          if (const auto leaving = walk.trace(numbers))
            catcher.add(*leaving, groups[static_cast<std::size_t>(group)]);
      }
    });
    if (stop.stop_requested()) return cancelled("light of a beam: stopped");
    for (const Weights& group : groups)
      for (const auto& [pixel, weight] : group) sums[pixel][c] += weight;
    events.progress({"light of the beam",
                     (static_cast<double>(c) + 1.0) / 3.0,
                     std::nullopt,
                     nlohmann::json::object()});
  }
  const auto in_a_group = beam.paths / kPathGroups;
  const auto paths = static_cast<double>(in_a_group * kPathGroups);
  for (const auto& [pixel, sum] : sums) {
    const double unit =
        options.depolarised * beam.power_w / paths * catcher.radiance(pixel, options.ior);
    light.lit_.push_back({pixel, {unit * sum[0], unit * sum[1], unit * sum[2]}});
  }
  return light;
}

void BeamLight::add(double share, Image<float>& radiance) const {
  if (share <= 0.0) return;
  for (const Lit& lit : lit_)
    for (std::size_t c = 0; c < 3; ++c)
      radiance.samples()[3 * std::size_t{lit.pixel} + c] +=
          static_cast<float>(share * lit.radiance[c]);
}

}  // namespace opaline::sim
