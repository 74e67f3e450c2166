#include "capture/black_taking.h"

#include <fmt/format.h>

#include <memory>
#include <optional>
#include <utility>

namespace opaline::capture {
namespace {

constexpr int kWhiteFrames = 8;

/// The shortest exposure, again and again.
class Shortest : public ExposureChooser {
 public:
  explicit Shortest(int times) : left_(times) {}
  std::optional<std::size_t> next() override {
    return left_ > 0 ? std::optional<std::size_t>(0) : std::nullopt;
  }
  void add(std::size_t /*index*/,
           const ExposurePair& /*pair*/,
           const FrameLight& /*light*/) override {
    --left_;
  }

 private:
  int left_;
};

Result<void> note(const TakenBlack& taken, double spent_s, EventSink& events) {
  const bool told = !taken.white.empty();
  return events.fact(
      "capture.black",
      {{"frames", taken.black.size()},
       {"exposed_s", spent_s},
       {"told_by_white", told},
       {"message",
        told ? fmt::format("black told by {} frames of white light and {} of its own",
                           taken.white.size(),
                           taken.black.size())
             : fmt::format("black is not a share of white light: {} frames of its own",
                           taken.black.size())}});
}

}  // namespace

Result<TakenBlack> take_blacks(RegionTaker& taker,
                               const PatternSet& patterns,
                               const RegionTaker::Settings& settings,
                               const Image<std::uint8_t>& seen,
                               EventSink& events,
                               const RegionTaker::Watcher& watcher,
                               std::stop_token stop) {
  const bool planned = settings.options.exposures.mode == ExposureMode::kPlanned;
  auto once = taker.take_black(patterns.black, false, watcher, stop);
  if (!once) return once.error();
  TakenBlack taken{std::move(once->frames), {}};
  if (!planned) return taken;
  double spent_s = seconds_asked(taken.black);
  auto white = taker.take_light(
      "white", patterns.white, BlackFrames(taken.black, settings.camera, seen), watcher, stop, [] {
        return std::make_unique<Shortest>(kWhiteFrames);
      });
  if (!white) return white.error();
  spent_s += seconds_asked(white->frames);
  if (BlackFrames(taken.black, settings.camera, seen, white->frames).told()) {
    taken.white = std::move(white->frames);
  } else {
    auto repeated = taker.take_black(patterns.black, true, watcher, std::move(stop));
    if (!repeated) return repeated.error();
    taken.black = std::move(repeated->frames);
    spent_s += seconds_asked(taken.black);
  }
  if (auto noted = note(taken, spent_s, events); !noted) return noted.error();
  return taken;
}

}  // namespace opaline::capture
