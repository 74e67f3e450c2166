#include "daemon/report/uncertainty_section.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <utility>

#include "base/material.h"
#include "daemon/report/html.h"

namespace opaline::daemon {
namespace {

using nlohmann::json;
using Row = std::vector<std::string>;

constexpr std::array kColors{"#c03020", "#208040", "#2050c0"};
constexpr std::size_t kDepths = 6;  // columns
constexpr double kUnknown = 0.9;    // of the amplitude

struct Quantity {
  const char* key;
  const char* symbol;
  const char* caption;
};
constexpr std::array kQuantities{
    Quantity{"reduced_scattering", "σs'", "How well reduced scattering is known, by depth"},
    Quantity{"absorption", "σa", "How well absorption is known, by depth"}};

struct Deviations {
  double prior = 0.0;
  double amplitude = 0.0;
  std::vector<double> layers;

  auto unknown() const {
    return std::ranges::count_if(layers, [&](double d) { return d >= kUnknown * amplitude; });
  }
};

struct Channel {
  std::string name;
  std::array<Deviations, kQuantities.size()> quantities;
  double determined = 0.0;
  double seconds = 0.0;
};

struct Told {
  double layer_mm = 0.0;
  std::vector<Channel> channels;

  double depth(std::size_t layer) const { return (static_cast<double>(layer) + 0.5) * layer_mm; }
  std::size_t layers() const { return channels.front().quantities.front().layers.size(); }
};

Channel channel_of(const json& told) {
  Channel channel;
  channel.name = told.value("channel", "");
  for (std::size_t q = 0; q < kQuantities.size(); ++q) {
    const json of = told.value(kQuantities[q].key, json::object());
    channel.quantities[q] = {of.value("prior", 0.0),
                             of.value("amplitude", 0.0),
                             of.value("layers", std::vector<double>())};
  }
  channel.determined =
      told.value("determined_diffusion", 0.0) + told.value("determined_absorption", 0.0);
  channel.seconds = told.value("seconds", 0.0);
  return channel;
}

// No channels where the reconstruction has no deviations.
Told told_by(const json& reconstruction) {
  Told told;
  const json uncertainty = reconstruction.value("uncertainty", json::object());
  told.layer_mm = uncertainty.value("layer_mm", 0.0);
  for (const json& channel : uncertainty.value("channels", json::array()))
    told.channels.push_back(channel_of(channel));
  const auto fits = [&](const Channel& channel) {
    return std::ranges::all_of(channel.quantities, [&](const Deviations& d) {
      return !d.layers.empty() && d.layers.size() == told.layers();
    });
  };
  if (!std::ranges::all_of(told.channels, fits)) told.channels.clear();
  return told;
}

// From the seen face to the other one.
std::vector<std::size_t> shown_layers(std::size_t layers) {
  if (layers == 1) return {0};
  std::vector<std::size_t> shown;
  const std::size_t count = std::min(layers, kDepths);
  for (std::size_t n = 0; n < count; ++n) shown.push_back(n * (layers - 1) / (count - 1));
  return shown;
}

std::string table_of(const Told& told) {
  const std::vector<std::size_t> shown = shown_layers(told.layers());
  Row header{"channel", "before"};
  for (const std::size_t layer : shown)
    header.push_back(fmt::format("{:.3g} mm", told.depth(layer)));
  header.insert(header.end(), {"unknown layers", "numbers determined", "time"});
  std::vector<Row> rows;
  for (const Channel& channel : told.channels) {
    for (std::size_t q = 0; q < kQuantities.size(); ++q) {
      const Deviations& d = channel.quantities[q];
      Row row{fmt::format("{}: {}", channel.name, kQuantities[q].symbol),
              fmt::format("{:.2f}", d.prior)};
      for (const std::size_t layer : shown) row.push_back(fmt::format("{:.2f}", d.layers[layer]));
      row.push_back(fmt::format("{} of {}", d.unknown(), d.layers.size()));
      row.push_back(q == 0 ? fmt::format("{:.0f}", channel.determined) : "");
      row.push_back(q == 0 ? fmt::format("{:.1f} s", channel.seconds) : "");
      rows.push_back(std::move(row));
    }
  }
  return html::table(header, rows);
}

// Nothing where no light was held out.
std::string budget_of(const json& reconstruction) {
  const json told = reconstruction.value("uncertainty", json::object());
  const json budget = told.value("error_budget", json::object());
  if (budget.empty()) return "";
  std::vector<Row> rows;
  for (const auto& [key, meaning] :
       {std::pair{"noise", "noise of the held-out pictures"},
        {"calibration", "calibration: what an inexact place of the camera adds to the pictures"},
        {"model",
         "model: what no material explains in the pictures of the fit, beyond noise and grid"},
        {"discretisation", "discretisation: what a grid twice as fine changes, extrapolated"},
        {"undetermined", "undetermined: what the pictures of the fit leave open"},
        {"sum", "together (squares add)"},
        {"measured", "measured"}})
    rows.push_back({meaning, fmt::format("{:.2f} %", 100.0 * budget.value(key, 0.0))});
  return html::paragraph(
             "The relighting error of the held-out lights on the sample's surface, and what it is "
             "made of. An inexact calibration is shared by the pictures of the fit and the "
             "held-out "
             "ones: what it adds is the most that it can, and what it does to all of them alike, "
             "as "
             "a wrong scale would, shows in the coefficients and not here.") +
         html::table({"part", "relative error"}, rows);
}

CurvePlot plot_of(const Told& told, std::size_t q) {
  CurvePlot plot{"depth below the seen face, mm",
                 fmt::format("standard deviation of ln {}", kQuantities[q].symbol),
                 true,
                 {},
                 0.0,
                 "only the level known"};
  Series prior{"before any picture", "#909090", {}, {}};
  for (std::size_t layer = 0; layer < told.layers(); ++layer) {
    prior.x.push_back(told.depth(layer));
    prior.y.push_back(0.0);
  }
  const auto count = static_cast<double>(told.channels.size());
  for (std::size_t c = 0; c < told.channels.size(); ++c) {
    const Deviations& d = told.channels[c].quantities[q];
    plot.series.push_back({told.channels[c].name, kColors[c % kColors.size()], prior.x, d.layers});
    plot.level += d.amplitude / count;
    for (double& y : prior.y) y += d.prior / count;
  }
  plot.series.push_back(std::move(prior));
  return plot;
}

}  // namespace

std::string uncertainty_section(const json& reconstruction) {
  const Told told = told_by(reconstruction);
  if (told.channels.empty())
    return html::paragraph(
        "There are no deviations per cell: " +
        reconstruction.value("uncertainty_absent", "the reconstruction does not tell any") + ".");
  return html::paragraph(
             "Standard deviations of the natural logarithms, root mean square over each layer, by "
             "depth below the seen face: 0.1 is about 10 %, 0.7 a factor of two up or down. Before "
             "any picture is what was believed without one. A layer is unknown where the "
             "deviation is no less than nine tenths of how much cells were believed to vary about "
             "the sample's level: what material.vdb shows there is the level and what smoothness "
             "makes of the cells around, not something that was measured.") +
         table_of(told) +
         html::paragraph(
             "Deviations are about the values reported, which lie beside the most probable ones. "
             "The "
             "model's error counts, in part as noise that differs from datum to datum, in part as "
             "one that is smooth over a picture; where it is larger than model_error, the true "
             "deviations are larger. Those of each cell are in material.vdb: "
             "absorption_log_sd, reduced_scattering_log_sd, diffusion_log_sd; and how far the most "
             "probable logarithms lie beside those reported: absorption_log_shift, "
             "reduced_scattering_log_shift, diffusion_log_shift. About those the deviation is "
             "(sd² − shift²)^(1/2).") +
         budget_of(reconstruction);
}

std::vector<std::pair<std::string, CurvePlot>> uncertainty_plots(const json& reconstruction) {
  std::vector<std::pair<std::string, CurvePlot>> plots;
  const Told told = told_by(reconstruction);
  if (told.channels.empty() || told.layers() < 2) return plots;
  for (std::size_t q = 0; q < kQuantities.size(); ++q)
    plots.emplace_back(kQuantities[q].caption, plot_of(told, q));
  return plots;
}

}  // namespace opaline::daemon
