#include "daemon/calibrate/calibration_plots.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "calibration/response_fit.h"
#include "daemon/calibrate/report_figure.h"
#include "daemon/report/html.h"
#include "daemon/report/plot.h"

namespace opaline::daemon {
namespace {

using calibration::Record;
using calibration::StepRecord;

constexpr std::array<const char*, 3> kChannelNames{"red", "green", "blue"};
constexpr std::array<const char*, 3> kChannelColors{"#c0392b", "#27803b", "#2b5fc0"};
constexpr const char* kNowColor = "#2b5fc0";
constexpr const char* kBeforeColor = "#b0b0b0";

// What a step wrote down under a name; null where it did not.
nlohmann::json value_of(const Record& record, std::string_view step, const char* name) {
  const StepRecord* const found = record.find(step);
  return found == nullptr ? nlohmann::json() : found->values.value(name, nlohmann::json());
}

double share_of_limit(const calibration::Gate& gate) {
  return gate.limit > 0.0 ? 100.0 * gate.value / gate.limit : gate.passed() ? 0.0 : 200.0;
}

Series fitted_line(double gain, double read_noise, double brightest) {
  Series line{"fit", "#404040", {}, {}, SeriesStyle::kLine};
  for (int i = 0; i <= 20; ++i) {
    line.x.push_back(brightest * i / 20.0);
    line.y.push_back(line.x.back() / gain + std::pow(read_noise / gain, 2.0));
  }
  return line;
}

}  // namespace

std::string photon_transfer_plot(const Record& record, const std::stop_token& stop) {
  const auto channels = value_of(record, "radiometric", "photon_transfer");
  if (!channels.is_array() || !record.measured.gain_electrons_per_code) return {};
  CurvePlot plot;
  plot.x_label = "codes above black";
  plot.y_label = "variance, codes^2";
  double brightest = 0.0;
  for (std::size_t c = 0; c < std::min<std::size_t>(3, channels.size()); ++c) {
    Series points{kChannelNames[c], kChannelColors[c], {}, {}, SeriesStyle::kPoints};
    for (const auto& level : channels[c]) {
      points.x.push_back(level[0].get<double>());
      points.y.push_back(level[1].get<double>());
      brightest = std::max(brightest, points.x.back());
    }
    plot.series.push_back(std::move(points));
  }
  plot.series.push_back(fitted_line(*record.measured.gain_electrons_per_code,
                                    record.measured.read_noise_electrons.value_or(0.0),
                                    brightest));
  return figure(plot, "photon_transfer", "Photon transfer: the slope is 1 / gain", stop);
}

std::string response_plot(const Record& record, const std::stop_token& stop) {
  const auto table = value_of(record, "linearity", "curve");
  if (!table.is_array() || table.size() < 2 || !record.measured.response) return {};
  CurvePlot curve;
  curve.x_label = "share of the code range";
  curve.y_label = "light, share of full scale";
  CurvePlot off;
  off.x_label = "share of the code range";
  Series told{"Debevec, Malik", "#27803b", {}, {}, SeriesStyle::kPoints};
  Series used{"in use", "#404040", {}, {}, SeriesStyle::kLine};
  Series residual{"Debevec, Malik", "#27803b", {}, {}, SeriesStyle::kLinePoints};
  for (std::size_t i = 0; i < table.size(); ++i) {
    const double f = static_cast<double>(i) / static_cast<double>(table.size() - 1);
    const double s = table[i].get<double>();
    const double in_use = calibration::signal_at(*record.measured.response, f);
    told.x.push_back(f);
    told.y.push_back(s);
    used.x.push_back(f);
    used.y.push_back(in_use);
    residual.x.push_back(f);
    residual.y.push_back(100.0 * (s - in_use));
  }
  off.y_label = "off the response in use, % of full scale";
  curve.series = {std::move(told), std::move(used)};
  off.series = {std::move(residual)};
  return figure(curve,
                "response",
                "Response, in the linearity step by Debevec and Malik, and as in use",
                stop) +
         figure(off, "response_residual", "What the stack says, less the response in use", stop);
}

std::string exposure_plot(const Record& record, const std::stop_token& stop) {
  const auto exposures = value_of(record, "radiometric", "exposures");
  if (!exposures.is_array() || exposures.size() < 2) return {};
  CurvePlot plot;
  plot.x_label = "reported, s";
  plot.y_label = "measured, % off";
  plot.log_x = true;
  Series points{"exposures", kNowColor, {}, {}, SeriesStyle::kLinePoints};
  for (const auto& one : exposures) {
    const double reported = one.value("reported_s", 1.0);
    points.x.push_back(reported);
    points.y.push_back(100.0 * (one.value("measured_s", reported) / reported - 1.0));
  }
  plot.series = {std::move(points)};
  return figure(plot, "exposures", "Exposure times by the light they collected", stop);
}

std::string dark_map_plot(const Record& record, const std::stop_token& stop) {
  const auto rows = value_of(record, "black_level", "dark_map");
  if (!rows.is_array() || rows.empty() || !rows[0].is_array()) return {};
  Image<float> values(static_cast<int>(rows[0].size()), static_cast<int>(rows.size()), 1);
  for (int y = 0; y < values.height(); ++y) {
    for (int x = 0; x < values.width(); ++x)
      values.at(x, values.height() - 1 - y) =
          rows[static_cast<std::size_t>(y)][static_cast<std::size_t>(x)].get<float>();
  }
  const auto [low, high] = std::ranges::minmax(values.samples());
  MapPlot plot{{{"", std::move(values), 1.0, 1.0, "", ""}}, 1, 420, 420, "codes above black"};
  plot.lowest = low;
  plot.highest = high > low ? high : low + 1.0;
  return figure(plot, "dark_map", "The dark, over the picture as the camera has it", stop);
}

std::string patch_plot(const Record& record, const std::stop_token& stop) {
  BarPlot plot;
  plot.y_label = "CIEDE2000";
  for (const auto& [model, title, color] : {std::tuple{"matrix", "3 x 3", kBeforeColor},
                                            {"root_polynomial", "root polynomials", kNowColor}}) {
    const auto found = value_of(record, "colour", model);
    if (!found.is_object()) continue;
    Series bars{title, color, {}, {}};
    plot.groups.clear();
    for (const auto& patch : found.value("patches", nlohmann::json::array())) {
      plot.groups.push_back(patch.value("patch", ""));
      bars.y.push_back(patch.value("de2000", 0.0));
    }
    plot.series.push_back(std::move(bars));
  }
  if (plot.series.empty()) return {};
  return figure(plot, "patches", "Patches of the chart, each by a fit without it", stop);
}

std::string gate_plot(const Record& record,
                      const std::optional<Record>& before,
                      const std::stop_token& stop) {
  BarPlot plot;
  plot.y_label = "% of the limit";
  Series now{"now", kNowColor, {}, {}};
  Series then{"before", kBeforeColor, {}, {}};
  for (const StepRecord& step : record.steps) {
    const StepRecord* const old = before ? before->find(step.step) : nullptr;
    for (const calibration::Gate& gate : step.gates) {
      if (gate.unit.empty()) continue;
      plot.groups.push_back(fmt::format("{}: {}", step.step, gate.name));
      now.y.push_back(std::clamp(share_of_limit(gate), 0.0, 200.0));
      double share = 0.0;
      if (old != nullptr) {
        const auto same = std::ranges::find(old->gates, gate.name, &calibration::Gate::name);
        if (same != old->gates.end()) share = std::clamp(share_of_limit(*same), 0.0, 200.0);
      }
      then.y.push_back(share);
    }
  }
  if (plot.groups.empty()) return {};
  plot.height = 480;
  plot.level = 100.0;
  plot.level_title = "limit";
  if (before) plot.series.push_back(std::move(then));
  plot.series.push_back(std::move(now));
  return figure(
      plot, "gates", "Figures as shares of their limits (200 % and more at the top)", stop);
}

}  // namespace opaline::daemon
