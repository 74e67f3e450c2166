#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>

#include "calibration/procedure.h"
#include "calibration/step.h"

namespace opaline::calibration {
namespace {

constexpr double kBlackDoubt = 0.05;    // of black ...
constexpr double kRangeDoubt = 0.0005;  // ... or of the code range, whichever is more
constexpr double kWrong = 10.0;         // times as much
constexpr double kGammaDoubt = 0.05;
constexpr double kGammaWrong = 0.3;
constexpr double kLeakDoubt = 0.2;         // of the projector's black level ...
constexpr double kLeakDoubtFrom = 0.0002;  // ... and of its white

Agreement compare_devices(const Record& record, const FrameTaker& taker) {
  const drivers::CameraInfo& c = taker.camera();
  const drivers::ProjectorInfo& p = taker.projector();
  const DeviceIdentity camera{c.model, c.serial, c.width, c.height, c.bit_depth};
  const DeviceIdentity projector{p.model, p.serial, p.width, p.height, 0};
  if (camera == record.camera && projector == record.projector) return {};
  return {fmt::format("it is of camera {} ({}) and projector {} ({}), and this station has {} ({}) "
                      "and {} ({})",
                      record.camera.model,
                      record.camera.serial,
                      record.projector.model,
                      record.projector.serial,
                      c.model,
                      c.serial,
                      p.model,
                      p.serial),
          {}};
}

Result<double> dark_level(StepContext& context) {
  const auto frame = context.taker.dark(std::chrono::milliseconds(10), context.stop);
  if (!frame) return frame.error();
  std::vector<double> plain(std::size_t{1} << 16);
  for (std::size_t code = 0; code < plain.size(); ++code) plain[code] = static_cast<double>(code);
  const auto good = good_pixels(context);
  return mean_of(sum_of(*frame, plain, good)) /
         static_cast<double>(std::ranges::count(good.samples(), 1));
}

// Of the light above code 0, from one code to two thirds of it.
Result<double> gamma_now(StepContext& context, const Brightness& brightness) {
  const auto linear = linear_codes(linear_camera(context));
  const auto good = good_pixels(context);
  std::array<double, 3> sums{};
  const auto high = brightness.light[0];
  const auto low = static_cast<std::uint8_t>(high * 2 / 3);
  const std::array<std::uint8_t, 3> codes{high, low, 0};
  for (std::size_t k = 0; k < codes.size(); ++k) {
    const auto frame =
        context.taker.lit({codes[k], codes[k], codes[k]}, brightness.turns, context.stop);
    if (!frame) return frame.error();
    sums[k] = mean_of(sum_of(*frame, linear, good)) / seconds_of(frame->exposure);
  }
  return std::log((sums[0] - sums[2]) / (sums[1] - sums[2])) /
         std::log(static_cast<double>(high) / static_cast<double>(low));
}

void judge_black(const Record& record, double now, double highest, Agreement& agreement) {
  const double black = *record.measured.black_level;
  const double doubtful = std::max(kBlackDoubt * black, kRangeDoubt * (highest - black));
  const double drift = std::abs(now - black);
  if (drift <= doubtful) return;
  const std::string says =
      fmt::format("drifted black: {:.2f} codes now, {:.2f} when calibrated", now, black);
  if (drift > kWrong * doubtful) {
    agreement.wrong = says;
  } else {
    agreement.doubts.push_back(says);
  }
}

void judge_gamma(const Record& record, double now, Agreement& agreement) {
  const double gamma = *record.measured.projector_gamma;
  const double off = std::abs(now - gamma);
  if (off <= kGammaDoubt) return;
  const std::string says =
      fmt::format("projector gamma: {:.2f} now, {:.2f} when calibrated", now, gamma);
  if (!(off <= kGammaWrong)) {
    agreement.wrong = says;
  } else {
    agreement.doubts.push_back(says);
  }
}

void judge_projector_black(const Record& record,
                           const std::optional<double>& now,
                           Agreement& agreement) {
  const std::optional<double>& then = record.measured.projector_black;
  if (!then || !now) return;
  const double off = std::abs(*now - *then);
  if (off <= std::max(kLeakDoubt * *then, kLeakDoubtFrom)) return;
  agreement.doubts.push_back(fmt::format(
      "drifted projector black: {:.5f} of white now, {:.5f} when calibrated", *now, *then));
}

}  // namespace

Result<Agreement> compare_with_station(const Record& record,
                                       const capture::StationCalibration& given,
                                       const capture::Station& station,
                                       EventSink& events,
                                       std::stop_token stop) {
  const auto taker = FrameTaker::create(station, events);
  if (!taker) return taker.error();
  Agreement agreement = compare_devices(record, **taker);
  if (!agreement.wrong.empty()) return agreement;
  Record copy = record;
  StepContext context{**taker, given, copy, events, std::move(stop), "calibration"};
  context.progress(0.0, "does it still hold?");
  const auto black = dark_level(context);
  if (!black) return black.error();
  judge_black(record, *black, linear_camera(context).max_code(), agreement);
  if (!agreement.wrong.empty()) return agreement;
  const auto brightness = find_brightness(context);
  if (!brightness) return brightness.error();
  if (brightness->saturated || brightness->dark) return agreement;  // of the sample's making
  const auto gamma = gamma_now(context, *brightness);
  if (!gamma) return gamma.error();
  judge_gamma(record, *gamma, agreement);
  if (!agreement.wrong.empty()) return agreement;
  const auto leak = projector_black(context, *brightness);
  if (!leak) return leak.error();
  judge_projector_black(record, *leak, agreement);
  return agreement;
}

}  // namespace opaline::calibration
