#include "daemon/calibrate/view.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "base/io/image_io.h"
#include "calibration/frame_taker.h"
#include "calibration/viewfinder.h"

namespace opaline::daemon {
namespace {

using calibration::ViewFigures;

constexpr double kTooBright = 0.95;
constexpr double kTooDim = 0.4;
constexpr double kLongest = 0.5;  // seconds
constexpr int kDimmest = 34;

/// How the next picture is exposed.
struct ViewExposure {
  std::uint8_t code = 255;
  int turns = 1;
};

ViewExposure adjusted(ViewExposure now,
                      double brightest,
                      const calibration::FrameTaker& taker,
                      double turn) {
  if (brightest >= kTooBright) {
    if (now.turns > taker.least_turns()) {
      now.turns = std::max(taker.least_turns(), now.turns / 2);
    } else {
      now.code = static_cast<std::uint8_t>(std::max(kDimmest, now.code * 3 / 4));
    }
  } else if (brightest < kTooDim) {
    const bool longer = 2.0 * now.turns * turn <= kLongest && 2 * now.turns <= taker.most_turns();
    if (now.code < 255) {
      now.code = static_cast<std::uint8_t>(std::min(255, now.code * 4 / 3));
    } else if (longer) {
      now.turns *= 2;
    }
  }
  return now;
}

Result<void> write_view(const ViewOptions& options,
                        const Frame& frame,
                        const ViewFigures& figures,
                        double best,
                        int number,
                        FileOperations& files) {
  const auto picture =
      calibration::view_picture(frame.pixels, options.black, options.clipping, figures);
  const auto png = encode_image({picture, {}, {}}, ImageFormat::kPng);
  if (!png) return png.error();
  if (auto written = write_whole(files, options.directory / "view.png", *png); !written)
    return written;
  const nlohmann::json json{{"format", 1},
                            {"frame", number},
                            {"exposure_s", std::chrono::duration<double>(frame.exposure).count()},
                            {"focus", figures.focus},
                            {"best_focus", best},
                            {"saturated", figures.saturated},
                            {"coverage", figures.lit},
                            {"brightest", figures.brightest},
                            {"histogram", figures.histogram}};
  return write_whole(files, options.directory / "view.json", json.dump() + "\n");
}

}  // namespace

Result<void> run_viewfinder(const ViewOptions& options,
                            const capture::Station& station,
                            FileOperations& files,
                            EventSink& events,
                            const std::function<void(const std::string&)>& say,
                            const std::stop_token& stop) {
  if (auto made = files.make_directories(options.directory); !made) return made;
  const auto taker = calibration::FrameTaker::create(station, events);
  if (!taker) return taker.error();
  ViewExposure exposure{255, (*taker)->least_turns()};
  double best = 0.0;
  for (int number = 1; options.frames == 0 || number <= options.frames; ++number) {
    const auto frame =
        (*taker)->lit({exposure.code, exposure.code, exposure.code}, exposure.turns, stop);
    if (!frame && frame.error().code == ErrorCode::kCancelled) return ok();
    if (!frame) return frame.error();
    const auto figures = calibration::view_figures(frame->pixels, options.black, options.clipping);
    if (!figures) return figures.error();
    best = std::max(best, figures->focus);
    if (auto written = write_view(options, *frame, *figures, best, number, files); !written)
      return written;
    const double seconds = std::chrono::duration<double>(frame->exposure).count();
    say(
        fmt::format("{:>4}  {:.3g} s  focus {:.4g} (best {:.4g})  saturated {:.2f} %  lit {:.0f} % "
                    "of the picture",
                    number,
                    seconds,
                    figures->focus,
                    best,
                    100.0 * std::ranges::max(figures->saturated),
                    100.0 * figures->lit));
    exposure = adjusted(exposure, figures->brightest, **taker, seconds / exposure.turns);
  }
  return ok();
}

}  // namespace opaline::daemon
