#include "daemon/calibrate/view.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "base/clock.h"
#include "base/seconds.h"
#include "calibration/frame_taker.h"
#include "daemon/calibrate/view_frame.h"

namespace opaline::daemon {
namespace {

constexpr double kTooBright = 0.95;
constexpr double kTooDim = 0.4;
constexpr double kLongest = 0.5;  // seconds
constexpr int kDimmest = 34;
constexpr std::chrono::nanoseconds kBetweenViews = std::chrono::milliseconds(100);

/// How the next picture is exposed.
struct ViewExposure {
  std::uint8_t code = 255;
  int turns = 1;
};

ViewExposure adjusted(ViewExposure now,
                      double brightest,
                      const calibration::FrameTaker& taker,
                      double turn_s) {
  if (brightest >= kTooBright) {
    if (now.turns > taker.least_turns()) {
      now.turns = std::max(taker.least_turns(), now.turns / 2);
    } else {
      now.code = static_cast<std::uint8_t>(std::max(kDimmest, now.code * 3 / 4));
    }
  } else if (brightest < kTooDim) {
    const bool longer = 2.0 * now.turns * turn_s <= kLongest && 2 * now.turns <= taker.most_turns();
    if (now.code < 255) {
      now.code = static_cast<std::uint8_t>(std::min(255, now.code * 4 / 3));
    } else if (longer) {
      now.turns *= 2;
    }
  }
  return now;
}

Result<void> show_view(
    const ViewOptions& options, ViewFrame& view, double best, int number, FileOperations& files) {
  view.json["best_focus"] = best;
  view.json["by"] = "viewfinder";
  if (options.live != nullptr) {
    if (auto shown = options.live->show(view.png, view.json); !shown) return shown;
  }
  if (options.directory.empty()) return ok();
  if (auto written = write_whole(files, options.directory / "view.png", view.png); !written)
    return written;
  view.json["format"] = 1;
  view.json["frame"] = number;
  return write_whole(files, options.directory / "view.json", view.json.dump() + "\n");
}

std::string view_line(const ViewFrame& view, double best, int number, double exposure_s) {
  return fmt::format(
      "{:>4}  {:.3g} s  focus {:.4g} (best {:.4g})  saturated {:.2f} %  lit {:.0f} % "
      "of the picture",
      number,
      exposure_s,
      view.figures.focus,
      best,
      100.0 * std::ranges::max(view.figures.saturated),
      100.0 * view.figures.lit);
}

bool is_left_alone(const ViewOptions& options) {
  return options.live != nullptr && options.while_watched &&
         !options.live->is_watched(*options.while_watched);
}

}  // namespace

Result<void> run_viewfinder(const ViewOptions& options,
                            const capture::Station& station,
                            FileOperations& files,
                            EventSink& events,
                            const std::function<void(const std::string&)>& say,
                            const std::stop_token& stop) {
  if (!options.directory.empty()) {
    if (auto made = files.make_directories(options.directory); !made) return made;
  }
  const auto taker = calibration::FrameTaker::create(station, events);
  if (!taker) return taker.error();
  SystemClock clock;  // real time: people look at it
  ViewExposure exposure{255, (*taker)->least_turns()};
  double best = 0.0;
  for (int number = 1; options.frames == 0 || number <= options.frames; ++number) {
    const auto begun = clock.now();
    const auto frame =
        (*taker)->lit({exposure.code, exposure.code, exposure.code}, exposure.turns, stop);
    if (!frame && frame.error().code == ErrorCode::kCancelled) return ok();
    if (!frame) return frame.error();
    auto view = view_of(*frame, options.black, options.clipping);
    if (!view) return view.error();
    best = std::max(best, view->figures.focus);
    if (auto shown = show_view(options, *view, best, number, files); !shown) return shown;
    const double exposure_s = seconds(frame->exposure);
    say(view_line(*view, best, number, exposure_s));
    if (is_left_alone(options)) return ok();
    exposure = adjusted(exposure, view->figures.brightest, **taker, exposure_s / exposure.turns);
    const auto left = kBetweenViews - (clock.now() - begun);
    if (left.count() > 0 && !clock.sleep(left, stop)) return ok();
  }
  return ok();
}

}  // namespace opaline::daemon
