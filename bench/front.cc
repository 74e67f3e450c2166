#include "bench/front.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <filesystem>

#include "base/files.h"
#include "daemon/report/plot.h"

namespace opaline::bench {
namespace {

constexpr std::array kColors{"#1e8449", "#2471a3", "#b9770e", "#c0392b", "#7d3c98", "#138d75"};
constexpr double kPercent = 100.0;

void add(const FrontPoint& point, daemon::Series& series) {
  series.x.push_back(point.seconds);
  series.y.push_back(kPercent * point.error);
}

daemon::Series& series_of(const std::string& group, std::vector<daemon::Series>& all) {
  const auto at = std::ranges::find(all, group, &daemon::Series::title);
  if (at != all.end()) return *at;
  const std::string color = kColors[all.size() % kColors.size()];
  return all.emplace_back(daemon::Series{group, color, {}, {}, daemon::SeriesStyle::kPoints});
}

std::string table_of(const std::vector<FrontPoint>& points, const std::vector<FrontPoint>& front) {
  std::string table = "setting,group,seconds,error,front\n";
  for (const FrontPoint& point : points) {
    const bool best = std::ranges::find(front, point.name, &FrontPoint::name) != front.end();
    table += fmt::format("\"{}\",\"{}\",{:.6g},{:.6g},{}\n",
                         point.name,
                         point.group,
                         point.seconds,
                         point.error,
                         best ? 1 : 0);
  }
  return table;
}

}  // namespace

std::vector<FrontPoint> front_of(std::vector<FrontPoint> points) {
  std::ranges::sort(points, {}, &FrontPoint::seconds);
  std::vector<FrontPoint> front;
  for (FrontPoint& point : points)
    if (front.empty() || point.error < front.back().error) front.push_back(std::move(point));
  return front;
}

Result<void> draw_front(const std::vector<FrontPoint>& points,
                        std::string_view seconds_label,
                        std::string_view error_label,
                        const std::string& file) {
  const std::vector<FrontPoint> front = front_of(points);
  daemon::CurvePlot plot;
  plot.x_label = seconds_label;
  plot.y_label = error_label;
  plot.log_x = plot.log_y = true;
  plot.height = 420;
  for (const FrontPoint& point : points) add(point, series_of(point.group, plot.series));
  daemon::Series line{"front", "#555555", {}, {}, daemon::SeriesStyle::kLine};
  for (const FrontPoint& point : front) add(point, line);
  plot.series.push_back(std::move(line));
  const auto svg = daemon::draw(plot, "front", {});
  if (!svg) return svg.error();
  const std::string page = daemon::svg_file({*svg}, plot.width, plot.height);
  if (Result<void> written = write_whole(system_files(), file, page); !written) return written;
  const auto table = std::filesystem::path(file).replace_extension(".csv").string();
  return write_whole(system_files(), table, table_of(points, front));
}

}  // namespace opaline::bench
