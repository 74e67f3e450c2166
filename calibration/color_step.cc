#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "base/color_checker.h"
#include "calibration/chart_finder.h"
#include "calibration/color_fit.h"
#include "calibration/step.h"

namespace opaline::calibration {
namespace {

constexpr std::array<double, 3> kLights{1.0, 0.5, 0.25};  // of the brightest
constexpr std::size_t kWhitePatch = 18;
constexpr double kClippedChart = 0.001;
constexpr double kMeanOff = 1.5;
constexpr double kTailOff = 3.0;
constexpr double kMostOff = 5.0;

Gate yes_or_no(std::string name, bool wrong, std::string remedy) {
  return {std::move(name), wrong ? 2.0 : 0.0, 1.0, "", std::move(remedy)};
}

// Codes as a linear sensor would have them, black where it was.
Image<std::uint16_t> linearised(const StepContext& context, const Frame& frame) {
  const auto linear = linear_codes(linear_camera(context));
  const double black = context.record.measured.black_level.value_or(0.0);
  Image<std::uint16_t> picture = frame.pixels;
  for (std::uint16_t& code : picture.samples())
    code = static_cast<std::uint16_t>(std::clamp(std::lround(linear[code] + black), 0L, 65535L));
  return picture;
}

double full_code(const StepContext& context) {
  const auto linear = linear_codes(linear_camera(context));
  const auto range = code_range(context);
  return linear[static_cast<std::size_t>(std::lround(0.98 * range.clipping))] + range.black;
}

Result<std::vector<FoundChart>> photograph_chart(StepContext& context,
                                                 const Brightness& brightness) {
  const double gamma = context.record.measured.projector_gamma.value_or(1.0);
  const double black = context.record.measured.black_level.value_or(0.0);
  std::vector<FoundChart> charts;
  for (const double share : kLights) {
    context.progress(static_cast<double>(charts.size()) / kLights.size(),
                     fmt::format("exposure {}", charts.size() + 1));
    const auto code =
        static_cast<std::uint8_t>(std::lround(brightness.light[0] * std::pow(share, 1.0 / gamma)));
    const auto frame = context.taker.lit({code, code, code}, brightness.turns, context.stop);
    if (!frame) return frame.error();
    const auto found = find_chart(linearised(context, *frame), black, full_code(context));
    if (!found) return found.error();
    if (!*found) break;
    charts.push_back(**found);
  }
  return charts;
}

// Each exposure in the light of the first: scaled by what least squares makes of their patches.
std::vector<std::vector<CameraRgb>> alike(const std::vector<FoundChart>& charts) {
  std::vector<std::vector<CameraRgb>> exposures;
  for (const FoundChart& chart : charts) {
    double own = 0.0;
    double both = 0.0;
    for (std::size_t p = 0; p < chart.patches.size(); ++p) {
      own += chart.patches[p][1] * chart.patches[p][1];
      both += chart.patches[p][1] * charts.front().patches[p][1];
    }
    auto& patches = exposures.emplace_back(chart.patches.begin(), chart.patches.end());
    for (CameraRgb& rgb : patches) {
      for (double& value : rgb) value *= both / own;
    }
  }
  return exposures;
}

std::vector<Lab> chart_colours() {
  std::vector<Lab> colours;
  for (const ColorCheckerPatch& patch : kColorChecker) colours.push_back(patch.lab);
  return colours;
}

nlohmann::json differences_of(const ColorError& error) {
  nlohmann::json patches = nlohmann::json::array();
  for (std::size_t p = 0; p < error.patches.size(); ++p)
    patches.push_back({{"patch", kColorChecker[p].name}, {"de2000", error.patches[p]}});
  return {{"mean", error.mean}, {"p95", error.p95}, {"most", error.most}, {"patches", patches}};
}

void judge(const ColorError& error, StepRecord& record) {
  const std::string remedy =
      "light the chart evenly by the projector alone, without gloss; is it a ColorChecker Classic, "
      "and not faded?";
  record.gates.push_back({"mean colour difference", error.mean, kMeanOff, "CIEDE2000", remedy});
  record.gates.push_back(
      {"95 % quantile of colour differences", error.p95, kTailOff, "CIEDE2000", remedy});
  record.gates.push_back({"largest colour difference", error.most, kMostOff, "CIEDE2000", remedy});
}

// As the chart is published, and as the correction has it.
nlohmann::json seen_patches(const ColorCorrection& correction,
                            const std::vector<CameraRgb>& patches) {
  nlohmann::json list = nlohmann::json::array();
  for (std::size_t p = 0; p < patches.size(); ++p)
    list.push_back({{"patch", kColorChecker[p].name},
                    {"lab", kColorChecker[p].lab},
                    {"seen_lab", lab_from_xyz(correction.xyz(patches[p]))}});
  return list;
}

// The better of the two models by patches that they did not know.
Result<void> correct(StepContext& context,
                     const std::vector<FoundChart>& charts,
                     StepRecord& record) {
  const auto exposures = alike(charts);
  const std::vector<Lab> colours = chart_colours();
  const auto balance = balance_white(exposures.front()[kWhitePatch]);
  if (!balance) return balance.error();
  std::optional<ColorError> best;
  ColorModel chosen = ColorModel::kMatrix;
  for (const ColorModel model : {ColorModel::kMatrix, ColorModel::kRootPolynomial}) {
    auto error = leave_one_out(model, *balance, exposures.front(), colours, exposures);
    if (!error) return error.error();
    record.values[std::string(to_string(model))] = differences_of(*error);
    if (best && best->mean <= error->mean) continue;
    best = *std::move(error);
    chosen = model;
  }
  auto correction = fit_color(chosen, *balance, exposures.front(), colours);
  if (!correction) return correction.error();
  record.values["model"] = to_string(chosen);
  record.values["patches"] = seen_patches(*correction, exposures.front());
  record.values["white_balance"] = *balance;
  record.values["corners_px"] = charts.front().corners;
  judge(*best, record);
  context.record.measured.color = *std::move(correction);
  return ok();
}

}  // namespace

Result<StepRecord> color(StepContext& context) {
  StepRecord record{"colour", {}, {}, {}};
  context.record.measured.color.reset();
  const auto brightness = find_brightness(context);
  if (!brightness) return brightness.error();
  record.gates = brightness_gates(*brightness);
  if (!record.accepted()) return record;
  const auto charts = photograph_chart(context, *brightness);
  if (!charts) return charts.error();
  record.gates.push_back(yes_or_no(
      "no chart",
      charts->size() < kLights.size(),
      "hold a ColorChecker Classic of 24 patches flat in front of the camera, all of it in the "
      "picture and larger than a quarter of it"));
  if (!record.accepted()) return record;
  record.gates.push_back({"saturated chart",
                          std::ranges::max(charts->front().clipped),
                          kClippedChart,
                          "of a patch",
                          "close the aperture, or tilt the chart so that it does not shine"});
  const auto order = channel_order(charts->front().patches, chart_colours());
  record.gates.push_back(
      yes_or_no("swapped channels",
                order != std::array<int, 3>{0, 1, 2},
                fmt::format("red, green and blue of the chart are seen by channels {}: set the "
                            "camera's order of channels",
                            fmt::join(order, ", "))));
  if (!record.accepted()) return record;
  if (auto corrected = correct(context, *charts, record); !corrected) return corrected.error();
  return record;
}

}  // namespace opaline::calibration
