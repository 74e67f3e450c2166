#include "capture/gradient_sequence.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <utility>

#include "base/io/stage_record_io.h"
#include "base/log.h"
#include "base/seconds.h"
#include "capture/disk_space.h"
#include "capture/frame_store.h"
#include "capture/gradient_object.h"
#include "capture/hdr_file.h"
#include "capture/hdr_merge.h"
#include "capture/lamp_check.h"
#include "capture/lamp_file.h"
#include "capture/patterns.h"
#include "capture/region_taker.h"
#include "capture/stage_view.h"
#include "capture/stored_frames.h"
#include "drivers/stage_picture.h"

namespace opaline::capture {
namespace {

using std::chrono::nanoseconds;

constexpr const char* kBlackName = "black";
constexpr double kHopelessDrift = 10.0;  // over the limit

/// One run over a session directory.
class GradientSequence {
 public:
  GradientSequence(const GradientTask& task, const Station& station, const Workplace& workplace)
      : task_(task),
        station_(station),
        work_(workplace),
        lights_(task.lights),
        store_(workplace.files, workplace.directory / "frames"),
        seen_(task.camera.model.width, task.camera.model.height, 1, 1),
        started_(station.clock.now()) {}

  Result<GradientSummary> run(std::stop_token stop);

 private:
  using Frames = std::vector<CapturedFrame>;
  drivers::Pattern picture_of(const StageLight& light, std::uint64_t id) const;
  drivers::Pattern black_pattern() const;
  Result<RegionTaker*> taker(std::stop_token stop);
  Result<void> check_space() const;
  Result<void> take_black(std::stop_token stop);
  void use_black(Frames frames);
  Result<void> find_dead_lamps(std::stop_token stop);
  Result<std::vector<int>> ask_lamps(std::stop_token stop);
  Result<Frames> frames_of(std::size_t n, std::stop_token stop);
  Result<Frames> take(std::size_t n, const drivers::Pattern& pattern, std::stop_token stop);
  Result<void> do_light(std::size_t n, std::stop_token stop);
  Result<void> find_object(const HdrImage& constant);
  Result<void> judge_drift();
  Result<void> finish();
  void report(const std::string& name, std::optional<nanoseconds> exposure) const;

  const GradientTask& task_;
  const Station& station_;
  const Workplace& work_;
  std::vector<SphereLight> lights_;  // as believed, dead ones with intensity 0
  std::vector<StageLight> patterns_;
  FrameStore store_;
  Image<std::uint8_t> seen_;  // pixels that see the object; all, until that is known
  nanoseconds started_;
  Frames black_frames_;
  BlackFrames black_;
  std::unique_ptr<RegionTaker> taker_;
  std::optional<HdrMerge> merge_;
  double first_light_ = 0.0;
  GradientSummary summary_;
};

drivers::Pattern GradientSequence::picture_of(const StageLight& light, std::uint64_t id) const {
  return drivers::stage_picture(
      {id,
       light.codes,
       light.parallel ? drivers::Polarization::kParallel : drivers::Polarization::kCross,
       light.name});
}

drivers::Pattern GradientSequence::black_pattern() const {
  return picture_of({kBlackName, std::vector<std::uint8_t>(task_.lights.size(), 0)}, kBlackPattern);
}

void GradientSequence::use_black(Frames frames) {
  black_frames_ = std::move(frames);
  black_ = BlackFrames(black_frames_, task_.camera, seen_);
  merge_.emplace(task_.camera, black_.hot());
}

Result<RegionTaker*> GradientSequence::taker(std::stop_token stop) {
  if (taker_) return taker_.get();
  auto made = RegionTaker::create(station_, {task_.options, task_.camera}, work_.events);
  if (!made) return made.error();
  taker_ = *std::move(made);
  if (auto space = check_space(); !space) return space.error();
  if (!black_.cover(taker_->ladder())) {
    if (auto black = take_black(stop); !black) return black.error();
  }
  return taker_.get();
}

// Frames and pictures are counted at their size before compression.
Result<void> GradientSequence::check_space() const {
  constexpr std::uint64_t kRepeatsPlanned = 3;  // of a planned exposure, on average at most
  constexpr std::uint64_t kSpareForLogs = 4U << 20U;
  const bool repeats = task_.options.exposures.mode == ExposureMode::kPlanned;
  const std::uint64_t frames =
      taker_->ladder().size() * taker_->frame_bytes() * (repeats ? kRepeatsPlanned : 1);
  const std::uint64_t picture = taker_->frame_bytes() / 6 * 8 * sizeof(float);
  const auto missing = static_cast<std::uint64_t>(std::ranges::count_if(
      patterns_, [&](const StageLight& light) { return !store_.has(light.name); }));
  const std::uint64_t black = store_.has(kBlackName) ? 0 : frames;
  return require_space(work_, missing * (frames + picture) + black + kSpareForLogs, missing);
}

Result<void> GradientSequence::take_black(std::stop_token stop) {
  const drivers::Pattern black = black_pattern();
  auto taken = taker_->take_black(
      black, false, [this](nanoseconds e) { report(kBlackName, e); }, stop);
  if (!taken) return taken.error();
  if (auto saved = store_.save(kBlackName, black, taken->frames); !saved) return saved;
  use_black(std::move(taken->frames));
  return ok();
}

Result<GradientSequence::Frames> GradientSequence::take(std::size_t n,
                                                        const drivers::Pattern& pattern,
                                                        std::stop_token stop) {
  const std::string& name = patterns_[n].name;
  auto devices = taker(stop);
  if (!devices) return devices.error();
  auto taken = (*devices)->take_light(
      name, pattern, black_, [&](nanoseconds e) { report(name, e); }, stop);
  if (!taken) return taken.error();
  if (!taken->lit)
    return unavailable(
        fmt::format("{} is black even at {:.4g} s: are the lamps on, the lens cap off, the object "
                    "in the middle? Then start again: it goes on at {}",
                    name,
                    seconds((*devices)->ladder().back()),
                    name));
  if (taken->unsteady)
    return unavailable(
        fmt::format("{}, taken {} times: {}: fix object and camera, let the lamps warm "
                    "up, and start again",
                    name,
                    taken->retaken + 1,
                    taken->unsteady->message));
  summary_.retaken += taken->retaken;
  if (auto saved = store_.save(name, pattern, taken->frames); !saved) return saved.error();
  ++summary_.taken;
  auto noted = work_.events.fact(
      "region.captured",
      {{"region", name}, {"exposures", taken->frames.size()}, {"retaken", taken->retaken}});
  if (!noted) return noted.error();
  return std::move(taken->frames);
}

Result<GradientSequence::Frames> GradientSequence::frames_of(std::size_t n, std::stop_token stop) {
  const drivers::Pattern pattern = picture_of(patterns_[n], kFirstLight + n);
  auto stored = usable_frames(store_, patterns_[n].name, pattern, task_.camera.model, work_.events);
  if (!stored) return stored.error();
  std::vector<nanoseconds> exposures;
  for (const CapturedFrame& frame : *stored) exposures.push_back(frame.exposure_asked);
  if (stored->empty() || !black_.cover(exposures)) return take(n, pattern, stop);
  return stored;
}

Result<void> GradientSequence::do_light(std::size_t n, std::stop_token stop) {
  const std::string& name = patterns_[n].name;
  report(name, std::nullopt);
  const auto frames = frames_of(n, stop);
  if (!frames) return frames.error();
  std::vector<ExposurePair> pairs;
  for (const CapturedFrame& frame : *frames) {
    const auto pair = black_.pair(frame);
    if (!pair) return internal_error(fmt::format("{}: no black frame of its exposure", name));
    pairs.push_back(*pair);
  }
  const HdrImage hdr = merge_->merge(pairs);
  if (n == 0) {
    if (auto found = find_object(hdr); !found) return found;
    first_light_ = light_in(hdr, black_.footprint());
  }
  if (n + 1 == patterns_.size())
    summary_.drift = light_in(hdr, black_.footprint()) / first_light_ - 1.0;
  ++summary_.pictures;
  return write_hdr(work_.files, work_.directory / "hdr" / (name + ".exr"), hdr);
}

Result<void> GradientSequence::find_object(const HdrImage& constant) {
  const double white = task_.depolarised * mean_radiance(lights_, patterns_[0].codes);
  auto found = brighter_pixels(constant, task_.gradient.object_threshold, white);
  if (!found) return found.error();
  seen_ = *std::move(found);
  use_black(std::move(black_frames_));  // their footprint is the object from here on
  return ok();
}

Result<void> GradientSequence::judge_drift() {
  const double limit = task_.gradient.drift_limit;
  if (std::abs(summary_.drift) <= limit) return ok();
  log::warning("the lamps drifted by {:.2f} % during the capture", 100.0 * summary_.drift);
  auto noted = work_.events.fact("stage.drift", {{"drift", summary_.drift}, {"limit", limit}});
  if (!noted || std::abs(summary_.drift) <= kHopelessDrift * limit) return noted;
  return unavailable(
      fmt::format("the lamps drifted by {:.1f} % from the first picture to the last: let them warm "
                  "up for half an hour, and start a new session",
                  100.0 * summary_.drift));
}

Result<void> GradientSequence::finish() {
  taker_.reset();  // dark from here on
  if (auto steady = judge_drift(); !steady) return steady;
  StageRecord record = stage_view(task_.camera.model, task_.gradient.object_depth_mm);
  record.lights = lights_;
  record.depolarised = task_.depolarised;
  record.drift = summary_.drift;
  record.split = task_.gradient.patterns.split;
  const auto last = static_cast<double>(patterns_.size() - 1);
  for (std::size_t n = 0; n < patterns_.size(); ++n)
    record.pictures.push_back({patterns_[n].name,
                               patterns_[n].codes,
                               patterns_[n].parallel,
                               1.0 + summary_.drift * static_cast<double>(n) / last});
  if (auto written = write_stage_record(work_.files, work_.directory, record); !written)
    return written;
  return work_.events.fact("capture.completed",
                           {{"lights", summary_.pictures},
                            {"taken", summary_.taken},
                            {"retaken", summary_.retaken},
                            {"drift", summary_.drift}});
}

/// Lights them one by one; devices are opened with options that ask for one good exposure.
Result<std::vector<int>> GradientSequence::ask_lamps(std::stop_token stop) {
  auto devices = taker(stop);  // for the black frames
  if (!devices) return devices.error();
  taker_.reset();
  CaptureOptions quick = task_.options;
  quick.exposures.wanted_snr = 0.01;
  quick.retries = std::min(1, quick.retries);
  auto single = RegionTaker::create(station_, {quick, task_.camera}, work_.events);
  if (!single) return single.error();
  const auto told = [this](int lamp, int of) {
    work_.events.progress({"lamps",
                           static_cast<double>(lamp) / of,
                           std::nullopt,
                           {{"light", lamp + 1}, {"lights", of}}});
  };
  const auto check = check_lamps(
      **single, black_, task_.camera, lights_, axes_of(task_.camera.model)[2], told, stop);
  if (!check) return check.error();
  if (auto written = write_lamp_check(work_.files, work_.directory, *check); !written)
    return written.error();
  auto noted =
      work_.events.fact("stage.lamps", {{"tried", check->tried.size()}, {"dead", check->dead}});
  if (!noted) return noted.error();
  return check->dead;
}

Result<void> GradientSequence::find_dead_lamps(std::stop_token stop) {
  if (!task_.gradient.check_lamps) return ok();
  if (auto known = read_lamp_check(work_.directory)) {
    summary_.dead_lamps = *std::move(known);
  } else {
    auto found = ask_lamps(stop);
    if (!found) return found.error();
    summary_.dead_lamps = *std::move(found);
  }
  for (const int lamp : summary_.dead_lamps) {
    if (lamp < 0 || lamp >= std::ssize(lights_)) continue;
    log::warning("lamp {} does not shine; the others make up for it", lamp);
    lights_[static_cast<std::size_t>(lamp)].intensity = 0.0;
  }
  return ok();
}

Result<GradientSummary> GradientSequence::run(std::stop_token stop) {
  for (const std::filesystem::path& directory : {store_.directory(), work_.directory / "hdr"}) {
    if (auto made = work_.files.make_directories(directory); !made) return made.error();
  }
  remove_partial_files(work_.files, work_.directory);
  auto black = usable_frames(store_, kBlackName, black_pattern(), task_.camera.model, work_.events);
  if (!black) return black.error();
  if (!black->empty()) {
    use_black(*std::move(black));
  } else if (auto devices = taker(stop); !devices) {
    return devices.error();
  }
  if (auto found = find_dead_lamps(stop); !found) return found.error();
  auto patterns = stage_patterns(lights_, axes_of(task_.camera.model), task_.gradient.patterns);
  if (!patterns) return patterns.error();
  patterns_ = *std::move(patterns);
  if (task_.beam) patterns_.insert(patterns_.end() - 1, beam_alone(lights_.size()));
  if (auto noted = work_.events.fact("capture.planned", {{"pictures", patterns_.size()}}); !noted)
    return noted.error();
  for (std::size_t n = 0; n < patterns_.size(); ++n) {
    if (stop.stop_requested()) return cancelled(fmt::format("before {}", patterns_[n].name));
    if (auto done = do_light(n, stop); !done) return done.error();
  }
  if (auto finished = finish(); !finished) return finished.error();
  return summary_;
}

void GradientSequence::report(const std::string& name, std::optional<nanoseconds> exposure) const {
  const auto total = std::max(1.0, static_cast<double>(patterns_.size()));
  Progress progress{"capture", summary_.pictures / total, std::nullopt, nlohmann::json::object()};
  progress.detail = {{"region", name}};
  if (!patterns_.empty()) {  // not yet planned while the first black is taken
    progress.detail["light"] = summary_.pictures + 1;
    progress.detail["lights"] = patterns_.size();
  }
  if (exposure) progress.detail["exposure"] = fmt::format("{:.3g} s", seconds(*exposure));
  if (summary_.taken > 0) {
    const double elapsed = seconds(station_.clock.now() - started_) / station_.clock.pace();
    progress.seconds_left = elapsed / summary_.taken * (total - summary_.pictures);
  }
  work_.events.progress(progress);
}

}  // namespace

Result<void> validate(const GradientOptions& options) {
  if (!(options.object_threshold > 0.0 && options.object_threshold < 1.0))
    return invalid_argument(
        fmt::format("led_sphere.object_threshold = {}; expected 0 to 1", options.object_threshold));
  if (!(options.drift_limit > 0.0))
    return invalid_argument(
        fmt::format("led_sphere.drift_limit = {}; expected > 0", options.drift_limit));
  return ok();
}

Result<GradientSummary> capture_gradients(const GradientTask& task,
                                          const Station& station,
                                          const Workplace& workplace,
                                          std::stop_token stop) {
  if (auto good = validate(task.options); !good) return good.error();
  if (auto good = validate(task.gradient); !good) return good.error();
  const auto possible =
      stage_patterns(task.lights, axes_of(task.camera.model), task.gradient.patterns);
  if (!possible) return possible.error();
  return GradientSequence(task, station, workplace).run(std::move(stop));
}

}  // namespace opaline::capture
