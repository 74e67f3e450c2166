#include "daemon/scattering/sphere_plots.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>

#include "base/material.h"

namespace opaline::daemon {
namespace {

using reconstruct::LeftOut;
using reconstruct::ScatteringMaps;

constexpr std::array<const char*, 3> kChannelColors{"#c0392b", "#1e8449", "#2471a3"};
constexpr std::array<std::array<std::uint8_t, 3>, kReasons> kReasonColors{{{255, 255, 255},
                                                                           {40, 44, 50},
                                                                           {230, 60, 200},
                                                                           {90, 150, 230},
                                                                           {150, 90, 40},
                                                                           {120, 190, 240},
                                                                           {240, 160, 60},
                                                                           {200, 60, 60},
                                                                           {120, 200, 90},
                                                                           {220, 200, 70}}};

constexpr std::array<std::array<double, 3>, 8> kViridis{{{68, 1, 84},
                                                         {70, 50, 126},
                                                         {54, 92, 141},
                                                         {39, 127, 142},
                                                         {31, 161, 135},
                                                         {74, 193, 109},
                                                         {160, 218, 57},
                                                         {253, 231, 37}}};

std::array<std::uint8_t, 3> viridis(double share) {
  const double place = std::clamp(share, 0.0, 1.0) * (kViridis.size() - 1.0);
  const std::size_t below = std::min(static_cast<std::size_t>(place), kViridis.size() - 2);
  const double part = place - static_cast<double>(below);
  std::array<std::uint8_t, 3> color{};
  for (std::size_t k = 0; k < 3; ++k)
    color[k] = static_cast<std::uint8_t>(
        std::lround((1.0 - part) * kViridis[below][k] + part * kViridis[below + 1][k]));
  return color;
}

struct Span {
  double low = 0.0;
  double high = 1.0;
};

/// From the second to the 98th percentile of all channels.
Span span_of(const SphereMaps& maps, const MapView& view) {
  std::vector<float> values;
  for (const ScatteringMaps& m : maps.channels)
    for (std::size_t at = 0; at < m.left_out.size(); ++at)
      if (m.left_out[at] == LeftOut::kFound) values.push_back((m.*view.values)[at]);
  if (values.size() < 10) return {};
  std::ranges::sort(values);
  const auto at = [&](double share) {
    return values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1))];
  };
  const double low = at(0.02);
  const double high = at(0.98);
  return {low, high > low ? high : low * 1.01 + 1e-6};
}

}  // namespace

const std::array<MapView, 4> kMapViews{
    MapView{"diffusion", "Diffusion coefficient D, mm", &ScatteringMaps::diffusion},
    MapView{"translucency", "Translucency l_d, mm", &ScatteringMaps::translucency},
    MapView{"reduced_albedo", "Reduced albedo α'", &ScatteringMaps::reduced_albedo},
    MapView{"diffusion_log_sd", "Deviation of ln D (σ)", &ScatteringMaps::log_diffusion_deviation}};

Image<std::uint8_t> normal_picture(const Image<float>& normals) {
  Image<std::uint8_t> picture(normals.width(), normals.height(), 3);
  for (std::size_t at = 0; at < normals.pixel_count(); ++at) {
    const float* n = &normals.samples()[3 * at];
    if (n[0] == 0.0F && n[1] == 0.0F && n[2] == 0.0F) continue;
    const std::array<float, 3> shown{n[0], -n[1], n[2]};  // y up, as such pictures are read
    for (std::size_t k = 0; k < 3; ++k)
      picture.samples()[3 * at + k] =
          static_cast<std::uint8_t>(std::lround(127.5F * (1.0F + shown[k])));
  }
  return picture;
}

Image<std::uint8_t> reason_picture(const SphereMaps& maps, const Image<std::uint8_t>& measured) {
  Image<std::uint8_t> picture(measured.width(), measured.height(), 3);
  for (std::size_t at = 0; at < measured.pixel_count(); ++at) {
    if (measured.samples()[at] == reconstruct::kNotSeen) continue;
    const auto& color = kReasonColors[static_cast<std::size_t>(maps.channels[1].left_out[at])];
    for (std::size_t k = 0; k < 3; ++k) picture.samples()[3 * at + k] = color[k];
  }
  return picture;
}

MapPlot map_plot(const SphereMaps& maps, double pixel_mm, const MapView& view) {
  constexpr int kMostAcross = 240;
  const int factor = (maps.channels[0].width + kMostAcross - 1) / kMostAcross;
  MapPlot plot;
  plot.columns = 3;
  plot.panel_width = 240;
  plot.panel_height = 240 * maps.channels[0].height / maps.channels[0].width;
  plot.scale_label = view.title;
  const Span span = span_of(maps, view);
  const double margin = 0.002 * (span.high - span.low);  // what is rounded must not fall out
  plot.lowest = span.low - margin;
  plot.highest = span.high + margin;
  const double pixel = pixel_mm * factor;
  for (std::size_t c = 0; c < 3; ++c) {
    const ScatteringMaps& m = maps.channels[c];
    Image<float> panel(m.width / factor, m.height / factor, 1);
    for (int y = 0; y < panel.height(); ++y)
      for (int x = 0; x < panel.width(); ++x) {
        const std::size_t at =
            static_cast<std::size_t>(y) * factor * m.width + static_cast<std::size_t>(x) * factor;
        panel.at(x, panel.height() - 1 - y) = m.left_out[at] == LeftOut::kFound
                                                  ? std::clamp((m.*view.values)[at],
                                                               static_cast<float>(span.low),
                                                               static_cast<float>(span.high))
                                                  : std::numeric_limits<float>::quiet_NaN();
      }
    plot.panels.push_back({kChannelNames[c], std::move(panel), pixel, pixel, "mm", "mm"});
  }
  return plot;
}

MapPicture map_picture(const SphereMaps& maps, const MapView& view) {
  const Span span = span_of(maps, view);
  const int width = maps.channels[0].width;
  const int height = maps.channels[0].height;
  MapPicture picture{Image<std::uint8_t>(3 * width, height, 3), span.low, span.high};
  for (int c = 0; c < 3; ++c) {
    const ScatteringMaps& m = maps.channels[static_cast<std::size_t>(c)];
    for (int y = 0; y < height; ++y)
      for (int x = 0; x < width; ++x) {
        const std::size_t at = static_cast<std::size_t>(y) * width + x;
        if (m.left_out[at] != LeftOut::kFound) continue;
        const auto color = viridis(((m.*view.values)[at] - span.low) / (span.high - span.low));
        for (int k = 0; k < 3; ++k)
          picture.pixels.at(c * width + x, y, k) = color[static_cast<std::size_t>(k)];
      }
  }
  return picture;
}

CurvePlot diffusion_histogram(const SphereMaps& maps) {
  constexpr int kBins = 60;
  const Span span = span_of(maps, kMapViews[0]);
  CurvePlot plot;
  plot.x_label = "D, mm";
  plot.y_label = "share of pixels, %";
  for (std::size_t c = 0; c < 3; ++c) {
    const ScatteringMaps& m = maps.channels[c];
    Series series{
        std::string(kChannelNames[c]), kChannelColors[c], {}, std::vector<double>(kBins, 0.0)};
    double count = 0.0;
    for (std::size_t at = 0; at < m.left_out.size(); ++at) {
      if (m.left_out[at] != LeftOut::kFound) continue;
      const double share = (m.diffusion[at] - span.low) / (span.high - span.low);
      count += 1.0;
      if (share >= 0.0 && share < 1.0) series.y[static_cast<std::size_t>(share * kBins)] += 100.0;
    }
    for (int bin = 0; bin < kBins; ++bin) {
      series.x.push_back(span.low + (bin + 0.5) / kBins * (span.high - span.low));
      series.y[static_cast<std::size_t>(bin)] /= std::max(1.0, count);
    }
    series.style = SeriesStyle::kSteps;
    plot.series.push_back(std::move(series));
  }
  return plot;
}

CurvePlot beam_plot(const BeamMeasurement& measurement, double ior) {
  CurvePlot plot;
  plot.x_label = "distance from the beam, mm";
  plot.y_label = "exitance over entered power, 1/mm²";
  plot.log_y = true;
  for (std::size_t c = 0; c < 3; ++c) {
    const BeamChannel& channel = measurement.channels[c];
    plot.series.push_back({std::string(kChannelNames[c]),
                           kChannelColors[c],
                           channel.distance_mm,
                           channel.exitance,
                           SeriesStyle::kPoints});
    if (!channel.found) continue;
    Series fit{
        fmt::format("{}, dipole", kChannelNames[c]), kChannelColors[c], channel.distance_mm, {}};
    for (const double distance : channel.distance_mm)
      fit.y.push_back(reconstruct::dipole_exitance(
          channel.found->reduced_albedo, channel.found->diffusion, ior, distance));
    plot.series.push_back(std::move(fit));
  }
  return plot;
}

}  // namespace opaline::daemon
