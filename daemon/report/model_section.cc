#include "daemon/report/model_section.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <utility>
#include <vector>

#include "base/material.h"
#include "daemon/report/html.h"

namespace opaline::daemon {
namespace {

using nlohmann::json;
using Rows = std::vector<std::vector<std::string>>;

constexpr std::array kColors{"#c03020", "#208040", "#2050c0"};

const json& array_at(const json& of, const char* key) {
  static const json none = json::array();
  const auto found = of.find(key);
  return found != of.end() && found->is_array() ? *found : none;
}

std::string with_error(const json& rung, const char* value, const char* error) {
  return fmt::format("{:.3g} ± {:.2g}", rung.value(value, 0.0), rung.value(error, 0.0));
}

std::string answers(const json& channels) {
  std::string out;
  for (const json& channel : channels) {
    if (!channel.contains("model")) continue;
    out += html::paragraph(fmt::format("{}: {}. Why no finer model: {}.",
                                       channel.value("channel", ""),
                                       channel.value("model", ""),
                                       channel.value("model_reason", "")));
  }
  return out;
}

std::string number_with_interval(const json& fit, const char* name) {
  const json& interval = array_at(fit, fmt::format("{}_interval_95", name).c_str());
  return fmt::format("{:.4g} ({:.4g} to {:.4g})",
                     fit.value(name, 0.0),
                     interval.at(0).get<double>(),
                     interval.at(1).get<double>());
}

std::string two_numbers(const json& channels) {
  Rows rows;
  for (const json& channel : channels) {
    const json fit = channel.value("homogeneous", json::object());
    if (array_at(fit, "absorption_interval_95").size() != 2 ||
        array_at(fit, "reduced_scattering_interval_95").size() != 2)
      continue;
    rows.push_back({channel.value("channel", ""),
                    number_with_interval(fit, "reduced_scattering"),
                    number_with_interval(fit, "absorption")});
  }
  if (rows.empty()) return "";
  return html::paragraph(
             "Two numbers say all of a homogeneous channel; 95 % intervals, from the "
             "noise and the model's error:") +
         html::table({"channel", "σs', 1/mm", "σa, 1/mm"}, rows);
}

std::string source_answer(const json& reconstruction) {
  const json choice = reconstruction.value("source_choice", json::object());
  if (!choice.contains("taken")) return "";
  return html::paragraph(fmt::format(
      "Light enters: {} source; {}.", choice.value("taken", ""), choice.value("why", "")));
}

Rows ladder_rows(const json& channel) {
  Rows rows;
  for (const json& rung : array_at(channel, "ladder")) {
    const bool first = rows.empty();
    const bool judged = rung.value("held_out_chi_squared_per_datum", 0.0) > 0.0;
    rows.push_back(
        {channel.value("channel", "") + ": " + rung.value("model", ""),
         fmt::format("{}", rung.value("parameters", 0L)),
         fmt::format("{:.3g}", rung.value("fitted_chi_squared_per_datum", 0.0)),
         judged ? with_error(rung, "held_out_chi_squared_per_datum", "held_out_standard_error")
                : "–",
         judged && !first ? with_error(rung, "gain", "gain_standard_error") : "–",
         fmt::format("{:.3g}", channel.value("held_out_noise_chi_squared_per_datum", 0.0)),
         fmt::format("{:.1f} s", rung.value("seconds", 0.0)),
         rung.value("taken", false) ? "yes" : "no",
         rung.value("why", "")});
  }
  return rows;
}

}  // namespace

std::string model_section(const json& reconstruction) {
  const json& channels = array_at(reconstruction, "channels");
  Rows rows;
  for (const json& channel : channels) {
    for (auto& row : ladder_rows(channel)) rows.push_back(std::move(row));
  }
  if (rows.empty()) return "";
  const bool crossed = std::ranges::any_of(
      channels, [](const json& channel) { return channel.value("cross_validated", false); });
  return source_answer(reconstruction) + answers(channels) + two_numbers(channels) +
         html::paragraph(fmt::format(
             "Models from the simplest up, each judged by {}. χ² per datum: 1 is what the measured "
             "noise and the model's own error make, the noise floor what noise alone does. A finer "
             "model is taken where the held-out error falls by more than its standard error, and a "
             "structure is granted only where the simpler model leaves more than 1.",
             crossed ? "every fourth of the lights, kept from its fit"
                     : "the lights that were kept from the fit")) +
         html::table({"channel: model",
                      "parameters",
                      "χ², fitted",
                      "χ², held out",
                      "gain",
                      "noise floor",
                      "time",
                      "taken",
                      "because"},
                     rows,
                     true);
}

std::optional<CurvePlot> ladder_plot(const json& reconstruction) {
  CurvePlot plot{"", "held-out χ² per datum", true, {}, 1.0, "noise and model error"};
  std::size_t longest = 1;
  const json& channels = array_at(reconstruction, "channels");
  for (std::size_t c = 0; c < channels.size() && c < kColorChannels; ++c) {
    Series series{kChannelNames[c], kColors[c], {}, {}};
    std::string names;
    for (const json& rung : array_at(channels[c], "ladder")) {
      const double error = rung.value("held_out_chi_squared_per_datum", 0.0);
      if (!(error > 0.0)) return std::nullopt;
      series.x.push_back(static_cast<double>(series.x.size() + 1));
      series.y.push_back(error);
      names += fmt::format(
          "{}{}: {}", names.empty() ? "" : "   ", series.x.size(), rung.value("model", ""));
    }
    if (series.x.size() > longest) {
      longest = series.x.size();
      plot.x_label = names;
    }
    plot.series.push_back(std::move(series));
  }
  return longest > 1 ? std::optional(plot) : std::nullopt;
}

}  // namespace opaline::daemon
