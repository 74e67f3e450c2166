#include "capture/lamp_check.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "drivers/stage_picture.h"

namespace opaline::capture {
namespace {

constexpr double kLowestCosine = -0.09;  // 95 degrees
constexpr double kDeadShare = 0.1;       // of what the neighbours show
constexpr std::size_t kNeighbours = 6;
constexpr std::uint64_t kFirstLamp = 100'000;  // pattern ids

/// What the frames show a second, electrons, mean over the pixels; the brightest unclipped frame's.
double light_in(const TakenLight& taken,
                const BlackFrames& black,
                const CameraCalibration& camera) {
  double rate = 0.0;
  for (const CapturedFrame& frame : taken.frames) {
    const auto pair = black.pair(frame);
    if (!pair) continue;
    const FrameLight light = measure_light(camera, *pair, black.footprint(), 0.5);
    if (light.clipped_share == 0.0 || rate == 0.0)
      rate = light.mean_electrons / pair->light_seconds;
  }
  return rate;
}

}  // namespace

std::vector<int> dead_lamps(std::span<const SphereLight> lights,
                            std::span<const int> tried,
                            std::span<const double> light) {
  std::vector<int> dead;
  const auto direction = [&](std::size_t n) {
    return normalized(lights[static_cast<std::size_t>(tried[n])].position);
  };
  for (std::size_t n = 0; n < tried.size(); ++n) {
    std::vector<std::pair<double, double>> others;  // cosine, light
    for (std::size_t m = 0; m < tried.size(); ++m)
      if (m != n) others.emplace_back(dot(direction(n), direction(m)), light[m]);
    if (others.size() < kNeighbours) continue;
    std::ranges::partial_sort(
        others, others.begin() + kNeighbours, std::greater<>{}, &std::pair<double, double>::first);
    std::ranges::sort(
        others.begin(), others.begin() + kNeighbours, {}, [](const auto& o) { return o.second; });
    const double median =
        0.5 * (others[kNeighbours / 2 - 1].second + others[kNeighbours / 2].second);
    if (median > 0.0 && light[n] < kDeadShare * median) dead.push_back(tried[n]);
  }
  return dead;
}

Result<LampCheck> check_lamps(RegionTaker& taker,
                              const BlackFrames& black,
                              const CameraCalibration& camera,
                              std::span<const SphereLight> lights,
                              Vec3 towards_camera,
                              const std::function<void(int lamp, int of)>& told,
                              std::stop_token stop) {
  LampCheck check;
  for (std::size_t n = 0; n < lights.size(); ++n)
    if (lights[n].intensity > 0.0 &&
        dot(normalized(lights[n].position), towards_camera) > kLowestCosine)
      check.tried.push_back(static_cast<int>(n));
  std::vector<double> shown;
  for (const int lamp : check.tried) {
    told(static_cast<int>(shown.size()), static_cast<int>(check.tried.size()));
    drivers::StagePattern alone{kFirstLamp + static_cast<std::uint64_t>(lamp),
                                std::vector<std::uint8_t>(lights.size(), 0)};
    alone.codes[static_cast<std::size_t>(lamp)] = 255;
    alone.name = fmt::format("lamp_{}", lamp);
    const auto taken = taker.take_light(alone.name, drivers::stage_picture(alone), black, {}, stop);
    if (!taken) return taken.error();
    shown.push_back(taken->lit ? light_in(*taken, black, camera) : 0.0);
  }
  check.dead = dead_lamps(lights, check.tried, shown);
  return check;
}

}  // namespace opaline::capture
