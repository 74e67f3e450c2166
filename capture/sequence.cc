#include "capture/sequence.h"

#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <optional>
#include <system_error>
#include <utility>

#include "base/direct_light.h"
#include "base/io/dataset_io.h"
#include "base/log.h"
#include "base/seconds.h"
#include "capture/dataset_builder.h"
#include "capture/disk_space.h"
#include "capture/exposure_planner.h"
#include "capture/frame_store.h"
#include "capture/hdr_file.h"
#include "capture/hdr_merge.h"
#include "capture/patterns.h"
#include "capture/region_taker.h"
#include "capture/session_black.h"
#include "capture/stored_frames.h"
#include "capture/surface_map.h"

namespace opaline::capture {
namespace {

namespace fs = std::filesystem;
using std::chrono::nanoseconds;

constexpr std::uint64_t kRepeats = 3;            // of a planned exposure, on average at most
constexpr std::uint64_t kSpareBytes = 4u << 20;  // for logs and indices

bool any_set(const Image<std::uint8_t>& mask) {
  return std::ranges::any_of(mask.samples(), [](std::uint8_t m) { return m != 0; });
}

/// One run over a session directory.
class Sequence {
 public:
  Sequence(const CaptureTask& task,
           const Station& station,
           const Workplace& workplace,
           PatternSet patterns,
           SurfaceMap map)
      : task_(task),
        station_(station),
        work_(workplace),
        patterns_(std::move(patterns)),
        map_(std::move(map)),
        store_(workplace.files, workplace.directory / "frames"),
        dataset_(empty_dataset(task.sample, map_)),
        started_(station.clock.now()),
        black_({task.options, task.calibration.camera}, patterns_, map_, store_, workplace.events) {
  }

  Result<CaptureSummary> run(std::stop_token stop);

 private:
  struct Frames {
    std::vector<CapturedFrame> frames;
    bool lit = true;
    /// Why they cannot be used; not stored, so taken again by another run.
    std::string unsteady = {};
  };
  Result<void> prepare(std::stop_token stop);
  Result<void> note_plan();
  Result<void> check_space() const;
  Result<RegionTaker*> taker(std::stop_token stop);
  Result<void> do_light(const Light& light, std::stop_token stop);
  /// None when the light is to be taken.
  Result<std::vector<CapturedFrame>> load(const std::string& name, const drivers::Pattern& pattern);
  Result<Frames> frames_of(const Light& light, std::stop_token stop);
  Result<Frames> take(const Light& light, std::stop_token stop);
  Image<std::uint8_t> ignored_in(const Light& light) const;
  std::unique_ptr<ExposureChooser> chooser_of(const Light& light) const;
  Result<void> confirm_lamp(const std::string& region, std::stop_token stop);
  std::string why_masked(const HdrImage& hdr) const;
  Result<void> note_unusable(const Light& light, std::string_view why);
  Result<void> finish();
  void report(const std::string& region, std::optional<nanoseconds> exposure) const;

  const CaptureTask& task_;
  const Station& station_;
  const Workplace& work_;
  PatternSet patterns_;
  SurfaceMap map_;
  FrameStore store_;
  Dataset dataset_;
  nanoseconds started_;
  CaptureSummary summary_;
  SessionBlack black_;
  std::unique_ptr<RegionTaker> taker_;
  int unusable_regions_ = 0;
};

Result<CaptureSummary> Sequence::run(std::stop_token stop) {
  if (auto prepared = prepare(stop); !prepared) return prepared.error();
  for (const Light& light : patterns_.lights) {
    if (stop.stop_requested()) return cancelled(fmt::format("before {}", light.name));
    if (auto done = do_light(light, stop); !done) return done.error();
    ++summary_.lights;
  }
  if (auto finished = finish(); !finished) return finished.error();
  return summary_;
}

Result<void> Sequence::prepare(std::stop_token stop) {
  for (const fs::path& directory : {store_.directory(), work_.directory / "hdr"}) {
    if (auto made = work_.files.make_directories(directory); !made) return made;
  }
  remove_partial_files(work_.files, work_.directory);
  if (auto noted = note_plan(); !noted) return noted;
  if (auto loaded = black_.load(); !loaded) return loaded;
  const bool complete = std::ranges::all_of(
      patterns_.lights, [this](const Light& light) { return store_.has(light.name); });
  if (complete && !black_.frames().empty()) return ok();
  if (auto devices = taker(stop); !devices) return devices.error();
  return ok();
}

Result<void> Sequence::note_plan() {
  const auto uniform = std::ranges::count(patterns_.lights, true, &Light::uniform);
  const auto held_out = std::ranges::count(patterns_.lights, true, &Light::held_out) - uniform;
  const auto regions = std::ssize(patterns_.lights) - held_out - uniform;
  if (held_out < task_.options.patterns.held_out_lights) {
    log::warning("{} held-out lights instead of {}: no more of them differ on {} regions",
                 held_out,
                 task_.options.patterns.held_out_lights,
                 regions);
  }
  return work_.events.fact("capture.planned", {{"regions", regions}, {"held_out", held_out}});
}

// The devices are opened only when something is left to take. Where they, or the options, expose
// otherwise than before, so must the black frames.
Result<RegionTaker*> Sequence::taker(std::stop_token stop) {
  if (taker_) return taker_.get();
  auto made =
      RegionTaker::create(station_, {task_.options, task_.calibration.camera}, work_.events);
  if (!made) return made.error();
  taker_ = *std::move(made);
  taker_->use_black(black_.frames());
  if (auto space = check_space(); !space) return space.error();
  if (!black_.frames().cover(taker_->ladder())) {
    const auto watch = [this](nanoseconds exposure) { report(kBlackName, exposure); };
    if (auto black = black_.take(*taker_, watch, std::move(stop)); !black) return black.error();
  }
  return taker_.get();
}

// Frames and pictures are counted at their size before compression.
Result<void> Sequence::check_space() const {
  const bool repeats = task_.options.exposures.mode == ExposureMode::kPlanned;
  const std::uint64_t frames =
      taker_->ladder().size() * taker_->frame_bytes() * (repeats ? kRepeats : 1);
  const std::uint64_t picture = taker_->frame_bytes() / 6 * 8 * sizeof(float);
  const auto missing = static_cast<std::uint64_t>(std::ranges::count_if(
      patterns_.lights, [&](const Light& light) { return !store_.has(light.name); }));
  const std::uint64_t faces = task_.sample.block.face_cell_count(task_.sample.lit_face) +
                              task_.sample.block.face_cell_count(task_.sample.seen_face);
  const std::uint64_t dataset = faces * 7 * sizeof(float) * patterns_.lights.size();
  const std::uint64_t black = store_.has(kBlackName) ? 0 : frames;
  const std::uint64_t needed = missing * (frames + picture) + black + dataset + kSpareBytes;
  return require_space(work_, needed, missing);
}

Result<std::vector<CapturedFrame>> Sequence::load(const std::string& name,
                                                  const drivers::Pattern& pattern) {
  return usable_frames(store_, name, pattern, task_.calibration.camera.model, work_.events);
}

Result<Sequence::Frames> Sequence::frames_of(const Light& light, std::stop_token stop) {
  auto stored = load(light.name, light.pattern);
  if (!stored) return stored.error();
  std::vector<nanoseconds> exposures;
  for (const CapturedFrame& frame : *stored) exposures.push_back(frame.exposure_asked);
  if (stored->empty() || !black_.frames().cover(exposures)) return take(light, stop);
  Frames found{*std::move(stored)};
  const auto pairs = black_.pairs(light.name, found.frames);
  if (!pairs) return pairs.error();
  found.lit = black_.show_light(*pairs);
  return found;
}

// Cells that are lit directly where the lit face is seen: 1.
Image<std::uint8_t> Sequence::ignored_in(const Light& light) const {
  if (task_.sample.lit_face != task_.sample.seen_face || light.uniform) return {};
  const Block& block = task_.sample.block;
  const Face face = task_.sample.seen_face;
  Image<std::uint8_t> kept(block.face_width(face), block.face_height(face), 1, 1);
  mask_direct_light(block, face, light.irradiance, task_.options.direct_light_margin_mm, kept);
  for (std::uint8_t& k : kept.samples()) k = k == 0 ? 1 : 0;
  return kept;
}

std::unique_ptr<ExposureChooser> Sequence::chooser_of(const Light& light) const {
  const ExposureOptions& options = task_.options.exposures;
  const auto ladder = taker_->ladder();
  switch (options.mode) {
    case ExposureMode::kFixed:
      return std::make_unique<WholeLadder>(ladder.size());
    case ExposureMode::kPlanned:
      return std::make_unique<ExposurePlanner>(options,
                                               task_.calibration.camera,
                                               ladder,
                                               seconds(taker_->whole_ladder()),
                                               black_.cells(),
                                               ignored_in(light),
                                               black_.frames().worth(ladder));
    case ExposureMode::kBracket:
      break;
  }
  return std::make_unique<BracketChooser>(options, ladder.size());
}

Result<Sequence::Frames> Sequence::take(const Light& light, std::stop_token stop) {
  auto devices = taker(stop);
  if (!devices) return devices.error();
  auto taken = (*devices)->take_light(
      light.name,
      light.pattern,
      black_.frames(),
      [&](nanoseconds exposure) { report(light.name, exposure); },
      stop,
      [&] { return chooser_of(light); });
  if (!taken) return taken.error();
  summary_.retaken += taken->retaken;
  if (!taken->lit) {
    if (auto lamp = confirm_lamp(light.name, stop); !lamp) return lamp.error();
  }
  if (taken->unsteady)
    return Frames{std::move(taken->frames), true, std::move(taken->unsteady->message)};
  if (auto saved = store_.save(light.name, light.pattern, taken->frames); !saved)
    return saved.error();
  ++summary_.taken;
  const auto noted = work_.events.fact("region.captured",
                                       {{"region", light.name},
                                        {"held_out", light.held_out},
                                        {"exposures", taken->frames.size()},
                                        {"exposed_s", seconds_asked(taken->frames)},
                                        {"retaken", taken->retaken}});
  if (!noted) return noted.error();
  return Frames{std::move(taken->frames), taken->lit};
}

// A region without light is the sample's doing if the whole lit picture shows some, else the
// lamp's.
Result<void> Sequence::confirm_lamp(const std::string& region, std::stop_token stop) {
  auto white = taker_->take_light(
      "white", patterns_.white, black_.frames(), [&](nanoseconds t) { report("white", t); }, stop);
  if (!white) return white.error();
  if (white->lit) return ok();
  return unavailable(fmt::format(
      "{} is black even at {:.4g} s, and so is the whole picture lit: is the lamp on, the "
      "projector's cable in, the lens cap off? Then start again: it goes on at {}",
      region,
      seconds(taker_->ladder().back()),
      region));
}

Result<void> Sequence::note_unusable(const Light& light, std::string_view why) {
  log::warning("{} is masked: {}", light.name, why);
  summary_.unusable.push_back(light.name);
  auto noted =
      work_.events.fact("region.unusable", {{"region", light.name}, {"message", std::string(why)}});
  if (!noted || light.held_out) return noted;
  ++unusable_regions_;
  const auto regions = std::ranges::count(patterns_.lights, false, &Light::held_out);
  const double usable = 1.0 - static_cast<double>(unusable_regions_) / static_cast<double>(regions);
  if (usable >= task_.options.usable_share) return ok();
  return unavailable(fmt::format("{} of {} regions cannot be used; the last, {}: {}",
                                 unusable_regions_,
                                 regions,
                                 light.name,
                                 why));
}

Result<void> Sequence::do_light(const Light& light, std::stop_token stop) {
  report(light.name, std::nullopt);
  auto found = frames_of(light, stop);
  if (!found) return found.error();
  const auto pairs = black_.pairs(light.name, found->frames);
  if (!pairs) return pairs.error();
  const HdrImage hdr = black_.merge(*pairs);
  const fs::path path = work_.directory / "hdr" / (light.name + ".exr");
  if (auto written = write_hdr(work_.files, path, hdr); !written) return written;
  const SurfaceRadiance surface = map_.apply(hdr, task_.options.min_coverage);
  const bool usable = found->lit && found->unsteady.empty();
  Illumination measured =
      illumination_of(light, surface, task_.sample, task_.options.direct_light_margin_mm, usable);
  if (light.uniform) {
    dataset_.uniform = std::move(measured);
  } else {
    dataset_.illuminations.push_back(std::move(measured));
  }
  if (!found->lit) {
    return note_unusable(
        light,
        "it is black at every exposure though the lamp works: is the sample opaque "
        "there, or something in the light's way?");
  }
  if (!found->unsteady.empty()) {
    return note_unusable(
        light,
        fmt::format("its exposures do not agree, {} times: {}; keep hands and "
                    "room light away, fix sample, camera and lamp, and start again",
                    task_.options.retries + 1,
                    found->unsteady));
  }
  return any_set(surface.mask) ? ok() : note_unusable(light, why_masked(hdr));
}

std::string Sequence::why_masked(const HdrImage& hdr) const {
  const auto seen = black_.frames().footprint().samples();
  const auto pixels = std::ranges::count_if(seen, [](std::uint8_t s) { return s != 0; });
  std::ptrdiff_t saturated = 0;
  for (std::size_t i = 0; i < seen.size(); ++i) {
    if (seen[i] != 0 && hdr.saturated.samples()[i] != 0) ++saturated;
  }
  if (pixels > 0 && 2 * saturated >= pixels) {
    return fmt::format(
        "{} of {} pixels on the sample are saturated even at the shortest exposure: close the "
        "aperture or dim the lamp, bring the calibration up to date, and start a new session",
        saturated,
        pixels);
  }
  return fmt::format(
      "no surface cell has {:.0f} % of its area on usable pixels ({} of the {} on the sample are "
      "saturated): lower capture.min_coverage, take fewer cells, or bring the camera nearer, and "
      "start a new session",
      100.0 * task_.options.min_coverage,
      saturated,
      pixels);
}

Result<void> Sequence::finish() {
  taker_.reset();  // the lamp is dark from here on
  if (auto written = write_dataset(work_.files, work_.directory, dataset_); !written)
    return written;
  return work_.events.fact("capture.completed",
                           {{"lights", summary_.lights},
                            {"taken", summary_.taken},
                            {"retaken", summary_.retaken},
                            {"unusable", summary_.unusable}});
}

void Sequence::report(const std::string& region, std::optional<nanoseconds> exposure) const {
  const auto total = static_cast<double>(patterns_.lights.size());
  Progress progress{"capture", summary_.lights / total, std::nullopt, nlohmann::json::object()};
  progress.detail = {
      {"light", summary_.lights + 1}, {"lights", patterns_.lights.size()}, {"region", region}};
  if (exposure) progress.detail["exposure"] = fmt::format("{:.3g} s", seconds(*exposure));
  if (summary_.taken > 0) {
    const double elapsed = seconds(station_.clock.now() - started_) / station_.clock.pace();
    progress.seconds_left = elapsed / summary_.taken * (total - summary_.lights);
  }
  work_.events.progress(progress);
}

Result<void> check_sizes(const CaptureTask& task) {
  if (auto options = validate(task.options); !options) return options;
  if (auto calibration = validate(task.calibration); !calibration) return calibration;
  const Block& b = task.sample.block;
  const bool good = b.nx > 0 && b.ny > 0 && b.nz > 0 && b.hx > 0.0 && b.hy > 0.0 && b.hz > 0.0;
  if (!good) return invalid_argument("sample: expected a block of cells with sizes > 0");
  if (task.options.patterns.uniform_light && task.sample.lit_face != task.sample.seen_face)
    return invalid_argument(
        "uniform_light tells what the lit face reflects, which is not seen: expected lit_face = "
        "seen_face, or "
        "uniform_light = false");
  return ok();
}

}  // namespace

Result<CaptureSummary> capture_session(const CaptureTask& task,
                                       const Station& station,
                                       const Workplace& workplace,
                                       std::stop_token stop) {
  if (auto checked = check_sizes(task); !checked) return checked.error();
  auto patterns = make_patterns(
      task.options.patterns, task.sample.block, task.sample.lit_face, task.calibration.projector);
  if (!patterns) return patterns.error();
  const CameraCalibration& camera = task.calibration.camera;
  auto map = SurfaceMap::create(
      task.sample.block, task.sample.seen_face, camera.model, camera.place_covariance);
  if (!map) return map.error();
  map->add_light_slip(task.sample.block, task.sample.lit_face, task.calibration.projector);
  return Sequence(task, station, workplace, *std::move(patterns), *std::move(map)).run(stop);
}

}  // namespace opaline::capture
