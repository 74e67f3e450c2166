#include "daemon/report/report_plots.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "daemon/report/picture.h"

namespace opaline::daemon {
namespace {

constexpr std::array<const char*, 3> kChannelColors{"#d1495b", "#3a9d5d", "#3d7dca"};
constexpr float kBlank = std::numeric_limits<float>::quiet_NaN();

double value_of(const Material& material, Coefficient coefficient, int channel, std::size_t cell) {
  const ChannelCoefficients& c = material.channels[channel];
  switch (coefficient) {
    case Coefficient::kAbsorption:
      return c.absorption[cell];
    case Coefficient::kReducedScattering:
      return c.reduced_scattering[cell];
    case Coefficient::kDiffusion:
      return 1.0 / (3.0 * (c.absorption[cell] + c.reduced_scattering[cell]));
  }
  return 0.0;
}

std::string_view label_of(Coefficient coefficient) {
  switch (coefficient) {
    case Coefficient::kAbsorption:
      return "absorption σa, 1/mm";
    case Coefficient::kReducedScattering:
      return "reduced scattering σs', 1/mm";
    case Coefficient::kDiffusion:
      return "diffusion κ, mm";
  }
  return "";
}

/// The cut at depth index k, parallel to the z faces.
MapPanel flat_cut(
    const Material& m, Coefficient what, int channel, int k, std::string_view prefix) {
  const Block& b = m.block;
  MapPanel panel{fmt::format("{}z = {:.4g} mm", prefix, (k + 0.5) * b.hz),
                 Image<float>(b.nx, b.ny, 1),
                 b.hx,
                 b.hy,
                 "x, mm",
                 "y, mm"};
  for (int j = 0; j < b.ny; ++j) {
    for (int i = 0; i < b.nx; ++i) {
      panel.values.at(i, j) = static_cast<float>(value_of(m, what, channel, b.index(i, j, k)));
    }
  }
  return panel;
}

/// The cut through the middle, perpendicular to y.
MapPanel deep_cut(const Material& m, Coefficient what, int channel, std::string_view prefix) {
  const Block& b = m.block;
  const int j = b.ny / 2;
  MapPanel panel{fmt::format("{}y = {:.4g} mm", prefix, (j + 0.5) * b.hy),
                 Image<float>(b.nx, b.nz, 1),
                 b.hx,
                 b.hz,
                 "x, mm",
                 "z, mm"};
  for (int k = 0; k < b.nz; ++k) {
    for (int i = 0; i < b.nx; ++i) {
      panel.values.at(i, k) = static_cast<float>(value_of(m, what, channel, b.index(i, j, k)));
    }
  }
  return panel;
}

void add_cuts(
    const Material& m, Coefficient what, int channel, std::string_view prefix, MapPlot& plot) {
  for (int cut = 0; cut < 4; ++cut) {
    const int k = std::min(m.block.nz - 1, (2 * cut + 1) * m.block.nz / 8);
    plot.panels.push_back(flat_cut(m, what, channel, k, prefix));
  }
  plot.panels.push_back(deep_cut(m, what, channel, prefix));
}

double quantile(std::vector<float> values, double share) {
  if (values.empty()) return 0.0;
  const auto place = static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), values.begin() + place, values.end());
  return values[static_cast<std::size_t>(place)];
}

float channel_mean(const Image<float>& picture, int x, int y) {
  return (picture.at(x, y, 0) + picture.at(x, y, 1) + picture.at(x, y, 2)) / 3.0F;
}

/// Per cent of the light's brightest cell.
Image<float> residual(const Illumination& light, const SurfaceFit& fit) {
  std::vector<float> brightness;
  for (int y = 0; y < light.mask.height(); ++y) {
    for (int x = 0; x < light.mask.width(); ++x) {
      if (light.mask.at(x, y) != 0) brightness.push_back(channel_mean(light.radiance, x, y));
    }
  }
  const auto bright = static_cast<float>(std::max(quantile(std::move(brightness), 0.995), 1e-30));
  Image<float> map(light.mask.width(), light.mask.height(), 1, kBlank);
  for (int y = 0; y < map.height(); ++y) {
    for (int x = 0; x < map.width(); ++x) {
      if (light.mask.at(x, y) == 0) continue;
      map.at(x, y) = 100.0F *
                     (channel_mean(fit.predicted, x, y) - channel_mean(light.radiance, x, y)) /
                     bright;
    }
  }
  return map;
}

/// A range that holds all but the wildest values.
std::pair<double, double> range_of(const std::vector<MapPanel>& panels, double share) {
  std::vector<float> values;
  for (const MapPanel& panel : panels) {
    for (const float value : panel.values.samples()) {
      if (std::isfinite(value)) values.push_back(value);
    }
  }
  return {quantile(values, 1.0 - share), quantile(values, share)};
}

}  // namespace

std::string_view place_of(Coefficient coefficient) {
  switch (coefficient) {
    case Coefficient::kAbsorption:
      return "absorption";
    case Coefficient::kReducedScattering:
      return "reduced_scattering";
    case Coefficient::kDiffusion:
      return "diffusion";
  }
  return "";
}

std::string_view title_of(Coefficient coefficient) {
  switch (coefficient) {
    case Coefficient::kAbsorption:
      return "Absorption σa";
    case Coefficient::kReducedScattering:
      return "Reduced scattering σs'";
    case Coefficient::kDiffusion:
      return "Diffusion coefficient κ = 1 / (3 (σa + σs'))";
  }
  return "";
}

CurvePlot convergence_plot(const ReportData& data) {
  CurvePlot plot{"iteration (0: homogeneous fit)", "χ² per datum", true, {}, 0.0, ""};
  const nlohmann::json none = nlohmann::json::array();
  const nlohmann::json& channels =
      data.reconstruction.contains("channels") ? data.reconstruction["channels"] : none;
  for (std::size_t c = 0; c < channels.size() && c < kColorChannels; ++c) {
    Series series{kChannelNames[c], kChannelColors[c], {}, {}};
    for (const auto& step : channels[c].value("history", none)) {
      series.x.push_back(step.value("iteration", 0.0));
      series.y.push_back(step.value("chi_squared_per_datum", 0.0));
    }
    plot.series.push_back(std::move(series));
    plot.level += channels[c].value("target_chi_squared_per_datum", 0.0) /
                  static_cast<double>(channels.size());
  }
  plot.level_title = "stops here";
  return plot;
}

BarPlot fit_plot(const ReportData& data) {
  BarPlot plot{"relative error, %", {}, {}, 0.0, "noise floor"};
  for (int c = 0; c < kColorChannels; ++c) {
    plot.series.push_back({kChannelNames[c], kChannelColors[c], {}, {}});
  }
  for (const SurfaceFit& fit : data.fits) {
    if (fit.is_empty()) continue;
    plot.groups.push_back(fit.name);
    for (int c = 0; c < kColorChannels; ++c) {
      plot.series[c].y.push_back(100.0 * fit.errors.channels[c].relative());
    }
  }
  plot.level = 100.0 * data.fit().all().floor();
  return plot;
}

MapPlot residual_plot(const ReportData& data, bool held_out) {
  MapPlot plot;
  plot.diverging = true;
  plot.scale_label = "residual, % of the brightest cell";
  const Block& block = data.dataset.block;
  const int axis = axis_of(data.dataset.seen_face);
  const std::array<double, 3> h = block.spacing();
  for (std::size_t m = 0; m < data.fits.size(); ++m) {
    if (data.fits[m].held_out != held_out || data.fits[m].is_empty()) continue;
    plot.panels.push_back({data.fits[m].name,
                           residual(data.dataset.illuminations[m], data.fits[m]),
                           h[axis == 0 ? 1 : 0],
                           h[axis == 2 ? 1 : 2],
                           axis == 0 ? "y, mm" : "x, mm",
                           axis == 2 ? "y, mm" : "z, mm"});
  }
  const auto [low, high] = range_of(plot.panels, 0.995);
  plot.highest = round_up(std::max(std::abs(low), std::abs(high)));
  plot.lowest = -plot.highest;
  return plot;
}

MapPlot slices_plot(const ReportData& data, Coefficient coefficient, int channel) {
  MapPlot plot;
  plot.columns = 5;
  plot.panel_width = plot.panel_height = 130;
  plot.scale_label = label_of(coefficient);
  add_cuts(data.material, coefficient, channel, data.truth ? "found, " : "", plot);
  if (data.truth) add_cuts(*data.truth, coefficient, channel, "truth, ", plot);
  const auto [low, high] = range_of(plot.panels, 0.998);
  plot.lowest = low;
  plot.highest = high > low ? high : low + std::max(1e-9, 1e-3 * std::abs(low));
  return plot;
}

}  // namespace opaline::daemon
