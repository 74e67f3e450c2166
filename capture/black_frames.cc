#include "capture/black_frames.h"

#include <algorithm>
#include <utility>

#include "base/seconds.h"
#include "capture/exposure_plan.h"

namespace opaline::capture {
namespace {

using std::chrono::nanoseconds;

constexpr double kDominates = 5.0;

}  // namespace

bool leak_dominates(const CameraCalibration& camera, const Image<std::uint16_t>& black) {
  std::vector<std::uint16_t> codes(black.samples().begin(), black.samples().end());
  const auto upper =
      codes.begin() + std::ssize(codes) * 3 / 4;  // beside the sample it may be darker
  std::ranges::nth_element(codes, upper);
  const Electrons leak = electrons_from_code(camera, *upper);
  const double read = camera.read_noise_electrons;
  return leak.signal > kDominates * (read * read + leak.per_code * leak.per_code / 12.0);
}

BlackFrames::BlackFrames(std::vector<CapturedFrame> frames,
                         const CameraCalibration& camera,
                         const Image<std::uint8_t>& seen,
                         std::span<const CapturedFrame> white)
    : frames_(std::move(frames)), camera_(camera), footprint_(seen) {
  std::vector<const Image<std::uint16_t>*> pictures;
  for (const CapturedFrame& captured : frames_) pictures.push_back(&captured.frame.pixels);
  hot_ = find_hot_pixels(camera, pictures);
  others_.resize(frames_.size());
  for (std::size_t i = 0; i < frames_.size(); ++i) {
    for (const CapturedFrame& other : frames_) {
      if (&other != &frames_[i] && same_exposure(other.exposure_asked, frames_[i].exposure_asked))
        others_[i].push_back(&other.frame.pixels);
    }
  }
  std::ranges::transform(seen.samples(),
                         hot_.samples(),
                         footprint_.samples().begin(),
                         [](std::uint8_t s, std::uint8_t h) {
                           return static_cast<std::uint8_t>(s != 0 && h == 0 ? 1 : 0);
                         });
  if (!white.empty()) tell(white);
}

void BlackFrames::tell(std::span<const CapturedFrame> white) {
  std::vector<ExposurePair> pairs;
  for (const CapturedFrame& frame : white) {
    const auto own = pair(frame);
    if (own) pairs.push_back(*own);
  }
  std::vector<ToldBlack> told;
  for (std::size_t i = 0; i < frames_.size(); ++i) {
    const bool again =
        i > 0 && same_exposure(frames_[i].exposure_asked, frames_[i - 1].exposure_asked);
    if (again) {
      told.push_back(told.back());
      continue;
    }
    Pictures blacks{&frames_[i].frame.pixels};
    blacks.insert(blacks.end(), others_[i].begin(), others_[i].end());
    auto one = tell_black(camera_,
                          blacks,
                          exposed_seconds(camera_, seconds(frames_[i].frame.exposure)),
                          pairs,
                          footprint_);
    if (!one) return;
    told.push_back(*std::move(one));
  }
  told_ = std::move(told);
}

bool BlackFrames::cover(std::span<const nanoseconds> exposures) const {
  return std::ranges::all_of(exposures, [this](nanoseconds exposure) {
    return std::ranges::any_of(frames_, [exposure](const CapturedFrame& black) {
      return same_exposure(black.exposure_asked, exposure);
    });
  });
}

std::size_t BlackFrames::useful(std::span<const nanoseconds> exposures,
                                const CameraCalibration& camera) const {
  for (std::size_t i = 0; i < exposures.size(); ++i) {
    for (const CapturedFrame& black : frames_) {
      if (same_exposure(black.exposure_asked, exposures[i]) &&
          leak_dominates(camera, black.frame.pixels))
        return i + 1;
    }
  }
  return exposures.size();
}

std::vector<int> BlackFrames::worth(std::span<const nanoseconds> exposures) const {
  std::vector<int> worth;
  for (const nanoseconds exposure : exposures) {
    const auto black = std::ranges::find_if(frames_, [&](const CapturedFrame& frame) {
      return same_exposure(frame.exposure_asked, exposure);
    });
    const auto place = static_cast<std::size_t>(black - frames_.begin());
    if (black == frames_.end()) {
      worth.push_back(1);
    } else {
      worth.push_back(told() ? told_[place].blacks : 1 + static_cast<int>(others_[place].size()));
    }
  }
  return worth;
}

std::optional<ExposurePair> BlackFrames::pair(const CapturedFrame& light) const {
  const auto black = std::ranges::find_if(frames_, [&](const CapturedFrame& frame) {
    return same_exposure(frame.exposure_asked, light.exposure_asked);
  });
  if (black == frames_.end()) return std::nullopt;
  const auto place = static_cast<std::size_t>(black - frames_.begin());
  return ExposurePair{&light.frame.pixels,
                      &black->frame.pixels,
                      exposed_seconds(camera_, seconds(light.frame.exposure)),
                      exposed_seconds(camera_, seconds(black->frame.exposure)),
                      others_[place],
                      told() ? &told_[place] : nullptr};
}

}  // namespace opaline::capture
