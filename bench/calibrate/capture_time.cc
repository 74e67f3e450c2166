#include "bench/calibrate/capture_time.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <memory>
#include <vector>

#include "base/clock.h"
#include "base/events.h"
#include "base/seconds.h"
#include "capture/black_taking.h"
#include "capture/exposure_planner.h"
#include "capture/patterns.h"
#include "capture/region_taker.h"
#include "capture/surface_map.h"
#include "sim/light_transport.h"
#include "sim/rig.h"
#include "sim/sim_camera.h"
#include "sim/sim_projector.h"
#include "sim/transport_store.h"

namespace opaline::bench {
namespace {

using Responses = std::shared_ptr<const TransportResponses>;

constexpr std::uint64_t kPhotons = 1u << 16;
constexpr int kRepeats = 12;
constexpr double kMargin = 1.01;  // that plans leave
constexpr auto kPlanned = capture::ExposureMode::kPlanned;
constexpr std::size_t kEvery = 8;  // lights to one that is captured again

capture::StationCalibration believed(const sim::RigOptions& o) {
  capture::StationCalibration c;
  c.camera.model = o.camera.model;
  c.camera.full_well_electrons = o.camera.full_well_electrons;
  c.camera.vignetting = {o.camera.vignetting};
  c.projector.vignetting = {o.projector.vignetting};
  return c;
}

/// What exposures of 1/30 to 8 s take, each twice the one before.
double one_stop_seconds() {
  const auto ladder = capture::exposure_ladder(
      {.ratio = 2.0}, {std::chrono::nanoseconds(33'333'333), {}, std::chrono::seconds(10)});
  double sum = 0.0;
  for (const auto exposure : *ladder) sum += seconds(exposure);
  return sum;
}

/// A station over a sample, on a clock that stands still unless it is waited for.
class Bed {
 public:
  static Result<std::unique_ptr<Bed>> create(const Responses& responses,
                                             std::uint64_t seed,
                                             capture::ExposureMode mode) {
    std::unique_ptr<Bed> bed(new Bed);
    bed->options_.exposures.mode = mode;
    sim::RigOptions options;
    options.seed = seed;
    auto rig = sim::Rig::create(options, responses, &bed->clock_);
    if (!rig) return rig.error();
    bed->rig_ = *std::move(rig);
    bed->camera_.emplace(*bed->rig_);
    bed->projector_.emplace(*bed->rig_);
    bed->calibration_ = believed(options);
    auto map = capture::SurfaceMap::create(
        responses->block, responses->seen_face, bed->calibration_.camera.model);
    if (!map) return map.error();
    bed->map_.emplace(*std::move(map));
    auto patterns = capture::make_patterns(
        {}, responses->block, responses->lit_face, bed->calibration_.projector);
    if (!patterns) return patterns.error();
    bed->patterns_ = *std::move(patterns);
    auto taker = capture::RegionTaker::create({*bed->camera_, *bed->projector_, bed->clock_},
                                              {bed->options_, bed->calibration_.camera},
                                              bed->events_);
    if (!taker) return taker.error();
    bed->taker_ = *std::move(taker);
    auto taken = capture::take_blacks(*bed->taker_,
                                      bed->patterns_,
                                      {bed->options_, bed->calibration_.camera},
                                      bed->map_->footprint(),
                                      bed->events_,
                                      {},
                                      {});
    if (!taken) return taken.error();
    bed->black_seconds_ = seconds_asked(taken->black) + seconds_asked(taken->white);
    bed->black_ = capture::BlackFrames(
        std::move(taken->black), bed->calibration_.camera, bed->map_->footprint(), taken->white);
    bed->cells_.emplace(*bed->map_, bed->black_.footprint(), bed->options_.min_coverage);
    return bed;
  }

  Result<capture::TakenLight> take(const capture::Light& light) {
    return taker_->take_light(
        light.name,
        light.pattern,
        black_,
        {},
        {},
        [&]() -> std::unique_ptr<capture::ExposureChooser> {
          if (options_.exposures.mode == capture::ExposureMode::kPlanned) return planner();
          return std::make_unique<capture::WholeLadder>(taker_->ladder().size());
        });
  }
  std::unique_ptr<capture::ExposurePlanner> planner() const {
    return std::make_unique<capture::ExposurePlanner>(options_.exposures,
                                                      calibration_.camera,
                                                      taker_->ladder(),
                                                      seconds(taker_->whole_ladder()),
                                                      *cells_,
                                                      Image<std::uint8_t>(),
                                                      black_.worth(taker_->ladder()));
  }
  capture::SurfaceRadiance merged(const capture::TakenLight& light) const {
    std::vector<capture::ExposurePair> pairs;
    for (const auto& frame : light.frames) pairs.push_back(*black_.pair(frame));
    const capture::HdrMerge merge(calibration_.camera, black_.hot());
    return map_->apply(merge.merge(pairs), options_.min_coverage);
  }
  /// What is known after these frames, with those of another light's choice as taken.
  capture::ExposureProblem problem(const Bed& teller,
                                   const capture::TakenLight& seen,
                                   const capture::TakenLight& taken) const {
    const auto told = teller.planner();
    for (const auto& frame : seen.frames)
      told->add(frame.exposure_index, *teller.black_.pair(frame), capture::FrameLight{});
    capture::ExposureProblem problem = told->problem();
    for (auto& cell : problem.cells) {
      for (auto& light : cell) light.wanted_snr /= kMargin;
    }
    std::ranges::fill(problem.taken, 0);
    for (const auto& frame : taken.frames) {
      ++problem.taken[frame.exposure_index];
      problem.blacks[frame.exposure_index] =
          black_.worth(std::vector{frame.exposure_asked}).front();
    }
    return problem;
  }
  const std::vector<capture::Light>& lights() const { return patterns_.lights; }
  double black_seconds() const { return black_seconds_; }

 private:
  Bed() = default;
  ManualClock clock_;
  NullSink events_;
  capture::CaptureOptions options_;
  capture::StationCalibration calibration_;
  std::unique_ptr<sim::Rig> rig_;
  std::optional<sim::SimCamera> camera_;
  std::optional<sim::SimProjector> projector_;
  std::optional<capture::SurfaceMap> map_;
  capture::PatternSet patterns_;
  std::unique_ptr<capture::RegionTaker> taker_;
  capture::BlackFrames black_;
  std::optional<capture::PlannedCells> cells_;
  double black_seconds_ = 0.0;
};

Result<Responses> responses_of(const sim::SceneOptions& scene) {
  sim::ResponseOptions options;
  options.camera_centre = sim::demo_camera_model().centre();
  options.photons_per_patch = kPhotons;
  NullSink silent;
  auto made =
      sim::load_or_compute(scene, options, {"sim/data/demo_marble.transport", {}}, silent, {});
  if (!made) return made.error();
  return std::make_shared<const TransportResponses>(*std::move(made));
}

/// SNR^2 of the same light captured by stations of other noise, over what each says of its own: the mean of the ratio of the
/// variances said and found.
Result<double> realised(const Responses& responses, const std::vector<std::size_t>& lights) {
  std::vector<std::vector<capture::SurfaceRadiance>> captured(lights.size());
  for (int repeat = 0; repeat < kRepeats; ++repeat) {
    auto bed = Bed::create(responses, static_cast<std::uint64_t>(100 + repeat), kPlanned);
    if (!bed) return bed.error();
    for (std::size_t i = 0; i < lights.size(); ++i) {
      const auto taken = (*bed)->take((*bed)->lights()[lights[i]]);
      if (!taken) return taken.error();
      captured[i].push_back((*bed)->merged(*taken));
    }
  }
  double said = 0.0;
  double found = 0.0;
  for (const auto& repeats : captured) {
    const double dim = 0.01 * std::ranges::max(repeats.front().radiance.samples());
    for (std::size_t s = 0; s < repeats.front().radiance.samples().size(); ++s) {
      double mean = 0.0;
      double squares = 0.0;
      double variance = 0.0;
      for (const auto& one : repeats) {
        const double value = one.radiance.samples()[s];
        mean += value / kRepeats;
        squares += value * value / kRepeats;
        variance += one.variance.samples()[s] / kRepeats;
      }
      if (!(mean > 0.0) || !(variance > 0.0)) continue;
      const double scale = std::max(mean, dim);
      found += (squares - mean * mean) * kRepeats / (kRepeats - 1.0) / (scale * scale);
      said += variance / (scale * scale);
    }
  }
  return said / found;
}

}  // namespace

Result<CaptureTime> capture_time(const sim::SceneOptions& scene) {
  const auto responses = responses_of(scene);
  if (!responses) return responses.error();
  auto bed = Bed::create(*responses, 1, kPlanned);
  if (!bed) return bed.error();
  auto fixed_bed = Bed::create(*responses, 1, capture::ExposureMode::kFixed);
  if (!fixed_bed) return fixed_bed.error();
  CaptureTime time;
  time.fixed = (*fixed_bed)->black_seconds();
  const double one_stop = one_stop_seconds();
  time.one_stop = one_stop;  // black
  time.planned = time.planned_black = (*bed)->black_seconds();
  std::vector<std::size_t> again;
  for (std::size_t i = 0; i < (*bed)->lights().size(); ++i) {
    const capture::Light& light = (*bed)->lights()[i];
    const auto fixed = (*fixed_bed)->take(light);
    if (!fixed) return fixed.error();
    const auto planned = (*bed)->take(light);
    if (!planned) return planned.error();
    const capture::ExposureProblem problem = (*bed)->problem(**fixed_bed, *fixed, *planned);
    const bool in_reach =
        capture::share_reached((*fixed_bed)->problem(**fixed_bed, *fixed, *fixed)) >= 0.95;
    const double share = capture::share_reached(problem);
    const double limit = capture::photon_limit(problem);
    fmt::print(stderr,
               "  {}: fixed {:.2f} s, planned {:.2f} s in {} frames, photon limit {:.2f} s, {:.1f} "
               "% of cells\n",
               light.name,
               seconds_asked(fixed->frames),
               seconds_asked(planned->frames),
               planned->frames.size(),
               limit,
               100.0 * share);
    if (!in_reach) {
      ++time.out_of_reach;
      continue;
    }
    time.fixed += seconds_asked(fixed->frames);
    time.one_stop += one_stop;
    time.planned += seconds_asked(planned->frames);
    time.photon_limit += limit;
    time.share_reached = std::min(time.share_reached, share);
    if (i % kEvery == 0) again.push_back(i);
  }
  const auto ratio = realised(*responses, again);
  if (!ratio) return ratio.error();
  time.realised = *ratio;
  return time;
}

}  // namespace opaline::bench
