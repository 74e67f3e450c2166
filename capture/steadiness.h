#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "base/image.h"
#include "capture/exposure_comparison.h"
#include "capture/hdr_merge.h"

namespace opaline::capture {

/// What changed while the exposures of one light were taken.
enum class Unsteadiness : std::uint8_t {
  kMotion,   ///< the picture has shifted, or its light has changed in one place
  kFlicker,  ///< all of it is brighter in one exposure than in another
  kDrift,    ///< it grew, or faded, from each exposure to the next
  kLevels,   ///< bright and dark parts disagree: the camera's black or response has changed
};
std::string_view to_string(Unsteadiness kind);  ///< "motion", as in the event log

struct UnsteadyLight {
  Unsteadiness kind = Unsteadiness::kFlicker;
  double size = 0.0;       ///< relative, of the light; > 0
  double deviation = 0.0;  ///< of it, from the frames' noise
  double shift_px = 0.0;   ///< of kMotion, where all of the picture may have shifted; else 0
  std::optional<std::pair<int, int>> where;  ///< of kMotion in one place: its middle, px
  std::string message;  ///< "flicker: exposures differ by 3.1 % (0.02 % noise)"
};

/// One exposure of a light.
struct TimedExposure {
  ExposurePair pair;
  std::size_t exposure_index = 0;  ///< in the ladder
  double middle_s = 0.0;           ///< when, on the camera's clock
};

/// Compares the exposures of one light with each other, each with the next longer one (ExposureComparer). Unsteady is what is
/// five deviations of the noise (six, of the worst of all places) and
///
///   1 % of the light               flicker and drift, from the brightest to the dimmest exposure; what a shift of the picture changes
///   3 %                            of 16 x 16 pixels; levels
///   three times as much            through a response curve
///   more in dim light              what 0.03 codes do, to which black is told, and rounding where codes barely vary; through a curve 1 % of full scale
///
/// the limit that a calibration's `check` has for the light that two exposures tell.
///
/// That exposures disagree the same way each time that a light is taken is no flicker: their times, or the response, are not what the
/// calibration says. Three takes in a row that agree among themselves to half of the limit tell that, and from then on exposures are compared
/// with what they showed, to within a quarter of it. Of one camera.
class SteadinessCheck {
 public:
  explicit SteadinessCheck(const CameraCalibration& camera);

  /// What is unsteady in the exposures of one light, taken one after another; none when nothing is.
  struct Verdict {
    std::optional<UnsteadyLight> unsteady;
    std::string disagreement;  ///< that was found to be the same each time just now; else empty
  };
  Verdict judge(std::span<const TimedExposure> exposures, const Image<std::uint8_t>& footprint);
  /// Whether the picture moved, for good, between two takes of a light: one exposure of each, as long as the other.
  std::optional<UnsteadyLight> moved(const TimedExposure& before,
                                     const TimedExposure& now,
                                     const Image<std::uint8_t>& footprint) const;
  /// Another light comes: what was taken before was not of it.
  void next_light() { takes_.clear(); }

 private:
  using Signature = std::map<std::pair<std::size_t, std::size_t>, std::array<double, 4>>;
  struct Chain;
  struct Run;
  Run run_from(const Chain& chain, std::size_t first, std::size_t channel) const;
  double light_limit(const Chain& chain) const;
  Chain chain_of(std::span<const TimedExposure> exposures,
                 const Image<std::uint8_t>& footprint) const;
  using Part = ExposureComparison::Part;
  const Part* worst_of(const ExposureComparison& step) const;
  std::optional<UnsteadyLight> motion_in(const Chain& chain, double limit) const;
  std::optional<UnsteadyLight> light_in(const Chain& chain, double limit) const;
  std::optional<UnsteadyLight> levels_in(const Chain& chain, double limit) const;
  std::array<double, 4> known(const TimedExposure& a, const TimedExposure& b) const;
  bool same_each_time(double limit) const;

  ExposureComparer comparer_;
  double scale_;                  // of the limits
  double code_error_;             // of black or response, of full scale
  std::vector<Signature> takes_;  // unsteady ones of this light
  Signature known_;  // by exposures, what they show each time: light by channel, levels
};

}  // namespace opaline::capture
