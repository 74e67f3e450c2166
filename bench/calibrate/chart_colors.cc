#include "bench/calibrate/chart_colors.h"

#include <fmt/format.h>

#include <vector>

#include "calibration/chart_finder.h"
#include "sim/color_chart.h"
#include "sim/sensor.h"

namespace opaline::bench {
namespace {

constexpr double kChartSeconds[] = {0.005, 0.01, 0.02};

Result<std::vector<calibration::CameraRgb>> photographed(double seconds) {
  sim::CameraOptics camera;
  camera.sensitivity = {0.7e9, 1.0e9, 0.55e9};
  sim::ChartOptions chart;
  chart.corners = {{{45, 60}, {215, 70}, {210, 185}, {50, 175}}};
  const sim::ChartOptics optics(camera, {}, chart);
  Image<float> light = optics.light(Image<std::uint8_t>(8, 8, 3, 255)).sensor_radiance;
  for (float& sample : light.samples()) sample *= static_cast<float>(seconds);
  const auto picture = sim::Sensor(camera, 5).read(light, seconds, 11);
  const auto found = calibration::find_chart(picture, camera.black_level, camera.max_code());
  if (!found) return found.error();
  if (!*found) return not_found(fmt::format("no chart in the picture of {} s", seconds));
  std::vector<calibration::CameraRgb> patches;
  for (calibration::CameraRgb rgb : (*found)->patches) {
    for (double& value : rgb) value /= seconds;
    patches.push_back(rgb);
  }
  return patches;
}

}  // namespace

Result<ChartColors> chart_colors() {
  std::vector<std::vector<calibration::CameraRgb>> exposures;
  for (const double seconds : kChartSeconds) {
    auto patches = photographed(seconds);
    if (!patches) return patches.error();
    exposures.push_back(*std::move(patches));
  }
  std::vector<calibration::Lab> references;
  references.reserve(kColorChecker.size());
  for (const ColorCheckerPatch& patch : kColorChecker) references.push_back(patch.lab);
  const auto balance = calibration::balance_white(exposures.back()[18]);
  if (!balance) return balance.error();
  const auto error_of = [&](calibration::ColorModel model) {
    return calibration::leave_one_out(model, *balance, exposures.back(), references, exposures);
  };
  auto matrix = error_of(calibration::ColorModel::kMatrix);
  if (!matrix) return matrix.error();
  auto polynomial = error_of(calibration::ColorModel::kRootPolynomial);
  if (!polynomial) return polynomial.error();
  return ChartColors{*std::move(matrix), *std::move(polynomial)};
}

}  // namespace opaline::bench
