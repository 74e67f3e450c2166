#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <stop_token>
#include <string_view>
#include <vector>

#include "base/events.h"
#include "base/frame.h"
#include "base/result.h"
#include "calibration/attendant.h"
#include "calibration/frame_taker.h"
#include "calibration/geometry_options.h"
#include "calibration/record.h"
#include "calibration/response_fit.h"

namespace opaline::calibration {

/// What a step works with; everything outlives it.
struct StepContext {
  FrameTaker& taker;
  const capture::StationCalibration& given;  ///< what the rig file says
  Record& record;  ///< of the steps before; a step fills in what it measures
  EventSink& events;
  std::stop_token stop;
  std::string_view step = {};
  GeometryOptions geometry = {};
  Attendant* attendant = nullptr;  ///< perhaps nobody

  void progress(double fraction, std::string_view doing) const;
};

/// The steps. Each returns what it found and its gates, which may refuse it; an Error means that it could not be done.
Result<StepRecord> warm_up(StepContext& context);
Result<StepRecord> black_level(StepContext& context);
Result<StepRecord> linearity(StepContext& context);
Result<StepRecord> radiometric(StepContext& context);
/// Shows the board in all poses (pose_taker.h) and fits both lenses (pair_fit.h), with the projector's place.
Result<StepRecord> geometry(StepContext& context);
Result<StepRecord> check(StepContext& context);
Result<StepRecord> color(StepContext& context);

/// The camera as far as it has been measured, with codes for electrons: electrons_from_code() gives codes of a linear sensor.
capture::CameraCalibration linear_camera(const StepContext& context);
/// Linear codes above black by code.
std::vector<double> linear_codes(const capture::CameraCalibration& camera);
CodeRange code_range(const StepContext& context);
/// 1: a pixel that is not hot.
Image<std::uint8_t> good_pixels(const StepContext& context);

/// A light and an exposure under which no pixel that counts is full and the brightest is well lit.
struct Brightness {
  FlatLight light = kWhite;
  int turns = 1;
  double brightest = 0.0;  ///< of the codes: 99.9 % of samples are at most this
  bool saturated = false;  ///< even the dimmest light in the shortest exposure fills pixels
  bool dark = false;       ///< even the longest exposure shows next to nothing
};
Result<Brightness> find_brightness(StepContext& context);
/// A light under which the brightest pixels are next to dark in the shortest exposure and full in the longest, so that a stack
/// shows each of them at all codes; as nearly as there is one.
Result<Brightness> find_dim_light(StepContext& context);
/// What refuses a step whose light will not do.
std::vector<Gate> brightness_gates(const Brightness& brightness);

/// The projector's light at code 0 as a share of that at code 255, ProjectorCalibration::black_level b: of the light D of a lamp that is off, L0 of
/// code 0, and Lc of a code c,
///
///   b / (1 - b) = (L0 - D) / ((Lc - L0) (255 / c)^gamma)
///
/// over pixels at least half as bright as the brightest, in exposures up to 64 times as long as white wants. None where noise hides it.
Result<std::optional<double>> projector_black(StepContext& context, const Brightness& brightness);

/// Exposures of one light, shortest first.
struct Stack {
  std::vector<Frame> first;
  std::vector<Frame> second;            ///< once more; empty unless asked for
  std::vector<double> seconds() const;  ///< as the camera says
};
/// Each exposure `ratio` times the one before and a whole number of turns, until most pixels that are lit at all are full or
/// the camera can expose no longer.
Result<Stack> take_stack(StepContext& context, const Brightness& from, double ratio, bool pairs);

/// The response of each channel from the first frames of a stack, by fit_response(), over good pixels that the longest
/// exposure lights to a fifth of the range in some channel: those in the dark tell of noise alone.
Result<std::vector<ResponseFit>> fit_channels(const StepContext& context, const Stack& stack);

/// Sum over good pixels of linear codes above black, by channel.
std::array<double, 3> sum_of(const Frame& frame,
                             std::span<const double> linear,
                             const Image<std::uint8_t>& good);

/// Rms and such of a few numbers.
double mean_of(std::span<const double> values);
double relative_deviation(std::span<const double> values);
double seconds_of(std::chrono::nanoseconds time);

}  // namespace opaline::calibration
