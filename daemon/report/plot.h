#pragma once

#include <cstdint>
#include <stop_token>
#include <string>
#include <string_view>
#include <vector>

#include "base/image.h"
#include "base/result.h"

namespace opaline::daemon {

/// How a curve is drawn.
enum class SeriesStyle : std::uint8_t { kLine, kPoints, kLinePoints, kSteps };

/// A curve or a row of bars.
struct Series {
  std::string title;
  std::string color;  ///< "#rrggbb"
  std::vector<double> x;
  std::vector<double> y;
  SeriesStyle style = SeriesStyle::kLine;  ///< of a curve
  std::vector<std::string> labels{};       ///< beside the points; none, or one each
};

/// Curves over one axis.
struct CurvePlot {
  std::string x_label;
  std::string y_label;
  bool log_y = false;
  std::vector<Series> series;
  double level = 0.0;  ///< a dashed line across, when > 0
  std::string level_title;
  bool log_x = false;
  int width = 720;  ///< px
  int height = 340;
};

/// Groups of bars, one bar a series in each group.
struct BarPlot {
  std::string y_label;
  std::vector<std::string> groups;
  std::vector<Series> series;  ///< y only, one value a group
  double level = 0.0;          ///< a dashed line across, when > 0
  std::string level_title;
  int height = 340;  ///< px, the groups' names, which lean, included
};

/// One raster drawn in false colours; a value that is no number is left blank.
struct MapPanel {
  std::string title;
  Image<float> values;        ///< 1 channel, row 0 at the bottom: axes point as the sample's do
  double pixel_width = 1.0;   ///< mm
  double pixel_height = 1.0;  ///< mm
  std::string x_label;
  std::string y_label;
};

/// Rasters side by side under one scale.
struct MapPlot {
  std::vector<MapPanel> panels;
  int columns = 4;
  int panel_width = 170;  ///< px
  int panel_height = 170;
  std::string scale_label;
  double lowest = 0.0;
  double highest = 1.0;
  bool diverging = false;  ///< blue, white, red about the middle; else from dark to bright
};

/// A diverging colour scale by itself, lying.
struct ScalePlot {
  std::string label;
  double lowest = -1.0;
  double highest = 1.0;
};

/// Each drawn by gnuplot as an SVG element to stand in a page; `name` is unique in it.
/// Errors: kUnavailable when gnuplot is not installed (the message says how to get it); kTimeout;
///         kCancelled; kInternal with what gnuplot says.
Result<std::string> draw(const CurvePlot& plot, std::string_view name, std::stop_token stop);
Result<std::string> draw(const BarPlot& plot, std::string_view name, std::stop_token stop);
Result<std::string> draw(const MapPlot& plot, std::string_view name, std::stop_token stop);
Result<std::string> draw(const ScalePlot& plot, std::string_view name, std::stop_token stop);

/// An SVG file of drawings of one size, one below the other on white.
std::string svg_file(const std::vector<std::string>& drawings, int width, int height);

}  // namespace opaline::daemon
