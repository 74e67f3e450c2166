#include "daemon/report/plot.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "daemon/report/external_program.h"

namespace opaline::daemon {
namespace {

constexpr std::chrono::seconds kDeadline{30};
// Viridis (van der Walt and Smith 2015) and a diverging scale, by their stops.
constexpr std::string_view kSequential =
    R"(set palette defined (0 "#440154", 1 "#46327e", 2 "#365c8d", 3 "#277f8e", 4 "#1fa187", 5 "#4ac16d", 6 "#a0da39", 7 "#fde725"))";
constexpr std::string_view kDiverging =
    R"(set palette defined (0 "#2166ac", 1 "#67a9cf", 2 "#d1e5f0", 3 "#f7f7f7", 4 "#fddbc7", 5 "#ef8a62", 6 "#b2182b"))";

/// A gnuplot string.
std::string gnuplot_string(std::string_view text) {
  std::string out = "'";
  for (const char c : text) {
    if (static_cast<unsigned char>(c) < 0x20) continue;
    out += c;
    if (c == '\'') out += c;
  }
  return out + "'";
}

std::string gnuplot_number(double value) {
  return std::isfinite(value) ? fmt::format("{:.6g}", value) : "NaN";
}

std::string preamble(std::string_view name, int width, int height) {
  return fmt::format(
      "set terminal svg size {},{} dynamic standalone noenhanced font 'sans-serif,12' name {}\n"
      "set encoding utf8\nset datafile missing 'NaN'\n",
      width,
      height,
      gnuplot_string(name));
}

/// The SVG element without the XML declaration before it, as wide as it was drawn where there is
/// room.
Result<std::string> run_gnuplot(const std::string& script, int width, std::stop_token stop) {
  auto svg = run_program({"gnuplot", "-"}, script, kDeadline, std::move(stop));
  if (!svg && svg.error().code == ErrorCode::kUnavailable) {
    return unavailable(svg.error().message +
                       "; the report's plots need it: apt install gnuplot-nox");
  }
  if (!svg) return svg.error();
  const std::size_t begin = svg->find("<svg");
  if (begin == std::string::npos) return internal_error("gnuplot drew nothing");
  return fmt::format("<svg width=\"{}\"{}", width, svg->substr(begin + 4));
}

std::string level_line(double level, const std::string& title) {
  if (!(level > 0.0)) return "";
  return fmt::format(
      ", {} with lines dashtype 2 lw 1.5 lc rgb '#888888' title {}", level, gnuplot_string(title));
}

std::string axes(const std::string& x_label, const std::string& y_label) {
  return fmt::format("set xlabel {}\nset ylabel {}\nset grid lc rgb '#bbbbbb' lw 0.5\n",
                     gnuplot_string(x_label),
                     gnuplot_string(y_label));
}

std::string matrix(const Image<float>& values) {
  std::string text;
  for (int y = 0; y < values.height(); ++y) {
    for (int x = 0; x < values.width(); ++x) {
      text += gnuplot_number(values.at(x, y));
      text += x + 1 < values.width() ? ' ' : '\n';
    }
  }
  return text;
}

// Room around the panels, px: axes are written once, at the left and at the bottom.
constexpr double kLeft = 56.0;
constexpr double kBottom = 50.0;
constexpr double kRight = 110.0;
constexpr double kGap = 46.0;    // between panels, beside each other
constexpr double kTitle = 60.0;  // above each, with the tics of the one before

struct Layout {
  int rows;
  double width;
  double height;
};

Layout layout_of(const MapPlot& plot) {
  const int rows = (static_cast<int>(plot.panels.size()) + plot.columns - 1) / plot.columns;
  return {rows,
          kLeft + plot.columns * (plot.panel_width + kGap) + kRight,
          kBottom + rows * (plot.panel_height + kTitle)};
}

/// Where panel `index` lies, as shares of the whole drawing.
std::string placement(const MapPlot& plot, const Layout& layout, int index) {
  const double left = kLeft + index % plot.columns * (plot.panel_width + kGap);
  const int row = index / plot.columns;
  const double bottom = kBottom + (layout.rows - 1 - row) * (plot.panel_height + kTitle);
  return fmt::format(
      "set lmargin at screen {:.5f}\nset rmargin at screen {:.5f}\n"
      "set bmargin at screen {:.5f}\nset tmargin at screen {:.5f}\n",
      left / layout.width,
      (left + plot.panel_width) / layout.width,
      bottom / layout.height,
      (bottom + plot.panel_height) / layout.height);
}

std::string panel_script(const MapPlot& plot, int index) {
  const MapPanel& panel = plot.panels[index];
  const double sx = panel.pixel_width;
  const double sy = panel.pixel_height;
  const bool is_lowest = index + plot.columns >= static_cast<int>(plot.panels.size());
  // A panel that has another y axis than the one beside it says so.
  const bool has_own_y =
      index % plot.columns == 0 || plot.panels[index - 1].y_label != panel.y_label;
  return fmt::format(
      "set title {} offset 0,-0.7\nset xlabel {} offset 0,0.5\nset ylabel {} offset 1.5,0\n"
      "set xrange [0:{}]\nset yrange [0:{}]\n"
      "plot $panel{} matrix using (($1+0.5)*{}):(($2+0.5)*{}):3 with image notitle\n",
      gnuplot_string(panel.title),
      gnuplot_string(is_lowest ? panel.x_label : ""),
      gnuplot_string(has_own_y ? panel.y_label : ""),
      panel.values.width() * sx,
      panel.values.height() * sy,
      index,
      sx,
      sy);
}

/// The colour scale stands at the right, drawn with the first panel.
std::string scale_script(const MapPlot& plot, const Layout& layout) {
  const double tall = std::min(1.5 * plot.panel_height, layout.height - kBottom - kTitle);
  return fmt::format(
      "set colorbox vertical user origin screen {:.5f}, screen {:.5f} size screen {:.5f}, screen "
      "{:.5f}\nset cblabel {} offset 0.5,0\nset cbtics out\n",
      (layout.width - kRight + 4.0) / layout.width,
      (layout.height - kTitle + 20.0 - tall) / layout.height,
      14.0 / layout.width,
      tall / layout.height,
      gnuplot_string(plot.scale_label));
}

std::string_view gnuplot_style(SeriesStyle style) {
  switch (style) {
    case SeriesStyle::kLine:
      return "lines lw 2";
    case SeriesStyle::kPoints:
      return "points pt 7 ps 0.6";
    case SeriesStyle::kLinePoints:
      return "linespoints lw 2 pt 7 ps 0.5";
    case SeriesStyle::kSteps:
      return "steps lw 1.5";
  }
  return "lines";
}

/// The data of series `s`: x, y and the label.
std::string points_of(const Series& series, std::size_t s) {
  std::string text = fmt::format("$series{} << EOD\n", s);
  for (std::size_t i = 0; i < series.x.size(); ++i) {
    const std::string_view label = i < series.labels.size() ? series.labels[i] : std::string_view();
    text += fmt::format(
        "{} {} \"{}\"\n", gnuplot_number(series.x[i]), gnuplot_number(series.y[i]), label);
  }
  return text + "EOD\n";
}

std::string curve_of(const Series& series, std::size_t s) {
  std::string text = fmt::format("$series{} using 1:2 with {} lc rgb '{}' title {}",
                                 s,
                                 gnuplot_style(series.style),
                                 series.color,
                                 gnuplot_string(series.title));
  if (!series.labels.empty()) {
    text += fmt::format(
        ", $series{} using 1:2:3 with labels left rotate by 30 offset 0.4,0.4 font ',8' tc rgb "
        "'{}' notitle",
        s,
        series.color);
  }
  return text;
}

}  // namespace

Result<std::string> draw(const CurvePlot& plot, std::string_view name, std::stop_token stop) {
  std::string script = preamble(name, plot.width, plot.height) + axes(plot.x_label, plot.y_label);
  if (plot.log_x) script += "set logscale x\nset format x '%g'\n";
  if (plot.log_y) script += "set logscale y\nset format y '%g'\n";
  script += "set key outside right top\n";
  std::string curves;
  for (std::size_t s = 0; s < plot.series.size(); ++s) {
    script += points_of(plot.series[s], s);
    curves += (s == 0 ? "" : ", ") + curve_of(plot.series[s], s);
  }
  script += "plot " + curves + level_line(plot.level, plot.level_title) + "\n";
  return run_gnuplot(script, plot.width, std::move(stop));
}

Result<std::string> draw(const BarPlot& plot, std::string_view name, std::stop_token stop) {
  std::string script = preamble(name, 960, plot.height) + axes("", plot.y_label);
  script +=
      "set style data histograms\nset style histogram clustered gap 1\n"
      "set style fill solid 0.85 noborder\nset xtics rotate by -45 nomirror font ',10'\n"
      "set key outside right top\nset yrange [0:*]\nunset grid\nset grid y\n$bars << EOD\n";
  for (std::size_t g = 0; g < plot.groups.size(); ++g) {
    script += fmt::format("\"{}\"", plot.groups[g]);
    for (const Series& series : plot.series) script += " " + gnuplot_number(series.y[g]);
    script += "\n";
  }
  script += "EOD\nplot ";
  for (std::size_t s = 0; s < plot.series.size(); ++s) {
    script += fmt::format("{}$bars using {}:xtic(1) lc rgb '{}' title {}",
                          s == 0 ? "" : ", ",
                          s + 2,
                          plot.series[s].color,
                          gnuplot_string(plot.series[s].title));
  }
  script += level_line(plot.level, plot.level_title) + "\n";
  return run_gnuplot(script, 960, std::move(stop));
}

Result<std::string> draw(const MapPlot& plot, std::string_view name, std::stop_token stop) {
  const Layout layout = layout_of(plot);
  const int panels = static_cast<int>(plot.panels.size());
  std::string script =
      preamble(name, static_cast<int>(layout.width), static_cast<int>(layout.height));
  script += plot.diverging ? kDiverging : kSequential;
  script += fmt::format(
      "\nset cbrange [{}:{}]\nunset key\nset tics out nomirror\n", plot.lowest, plot.highest);
  for (int i = 0; i < panels; ++i) {
    script += fmt::format("$panel{} << EOD\n{}EOD\n", i, matrix(plot.panels[i].values));
  }
  script += scale_script(plot, layout) + "set multiplot\n";
  for (int i = 0; i < panels; ++i) {
    script += placement(plot, layout, i) + panel_script(plot, i) + "unset colorbox\n";
  }
  return run_gnuplot(script + "unset multiplot\n", static_cast<int>(layout.width), std::move(stop));
}

Result<std::string> draw(const ScalePlot& plot, std::string_view name, std::stop_token stop) {
  constexpr int kSteps = 128;
  Image<float> ramp(kSteps, 2, 1);
  for (int x = 0; x < kSteps; ++x) {
    const double share = (x + 0.5) / kSteps;
    const double value = plot.lowest + share * (plot.highest - plot.lowest);
    ramp.at(x, 0) = ramp.at(x, 1) = static_cast<float>(value);
  }
  const std::string script =
      preamble(name, 420, 100) + std::string(kDiverging) +
      fmt::format(
          "\nset cbrange [{0}:{1}]\nset xrange [{0}:{1}]\nset yrange [0:2]\n"
          "unset colorbox\nunset key\nunset ytics\nset xtics out nomirror\nset xlabel {2}\n"
          "set lmargin 2\nset rmargin 2\nset tmargin 0.3\nset bmargin 4\n$ramp << EOD\n{3}EOD\n"
          "plot $ramp matrix using ({0}+($1+0.5)*{4}):($2+0.5):3 with image notitle\n",
          plot.lowest,
          plot.highest,
          gnuplot_string(plot.label),
          matrix(ramp),
          (plot.highest - plot.lowest) / kSteps);
  return run_gnuplot(script, 420, std::move(stop));
}

std::string svg_file(const std::vector<std::string>& drawings, int width, int height) {
  const int total = height * static_cast<int>(drawings.size());
  std::string text = fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" xmlns:xlink=\"http://www.w3.org/1999/xlink\" "
      "width=\"{0}\" height=\"{1}\" viewBox=\"0 0 {0} {1}\">\n"
      "<rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n",
      width,
      total);
  for (std::size_t d = 0; d < drawings.size(); ++d) {
    text += fmt::format("<svg y=\"{}\" height=\"{}\"{}",
                        height * static_cast<int>(d),
                        height,
                        drawings[d].substr(4));  // after "<svg"
  }
  return text + "</svg>\n";
}

}  // namespace opaline::daemon
