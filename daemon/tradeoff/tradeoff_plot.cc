#include "daemon/tradeoff/tradeoff_plot.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <functional>

#include "daemon/report/plot.h"

namespace opaline::daemon {
namespace {

using reconstruct::TradeoffPoint;

using Points = std::vector<const TradeoffPoint*>;
using Value = std::function<double(const TradeoffPoint&)>;

constexpr int kWidth = 860;
constexpr int kHeight = 420;
constexpr std::string_view kQuality = "quality ";  // and its name
constexpr const char* kOther = "#17becf";          // a dial that is not among these
constexpr std::array<std::pair<std::string_view, const char*>, 8> kDials{
    {{"given", "#000000"},
     {"regions and grid", "#1f77b4"},
     {"tolerance", "#d62728"},
     {"iterations", "#2ca02c"},
     {"precision", "#ff7f0e"},
     {"optimiser", "#9467bd"},
     {"back end", "#8c564b"},
     {"grid correction", "#e377c2"}}};

/// What a point is drawn under.
std::string_view group_of(const TradeoffPoint& p) {
  const std::string_view dial = p.setting.dial;
  return dial.starts_with(kQuality) ? kQuality.substr(0, kQuality.size() - 1) : dial;
}

/// The dials that are turned, those known first.
std::vector<std::pair<std::string_view, const char*>> groups_of(const Points& points) {
  std::vector<std::pair<std::string_view, const char*>> groups(kDials.begin(), kDials.end());
  for (const TradeoffPoint* p : points) {
    const bool known = std::ranges::any_of(
        groups, [dial = group_of(*p)](const auto& group) { return group.first == dial; });
    if (!known) groups.emplace_back(group_of(*p), kOther);
  }
  return groups;
}

std::string short_name(const TradeoffPoint& p) {
  const auto& s = p.setting;
  if (s.dial.starts_with(kQuality)) return s.dial.substr(kQuality.size());
  if (s.dial == "grid correction") return "corrected";
  if (s.dial == "tolerance") return fmt::format("{:g}", s.options.tolerance);
  if (s.dial == "iterations") return fmt::format("{} it.", s.options.max_iterations);
  if (s.dial == "precision") return std::string(to_string(s.precision));
  if (s.dial == "optimiser") return std::string(to_string(s.options.method));
  if (s.dial == "back end") return std::string(to_string(s.options.back_end));
  return fmt::format("{0}×{0}, grid 1/{1:g}", s.reduction.regions, s.reduction.grid_step);
}

Series series_of(const Points& points,
                 std::string_view title,
                 const char* color,
                 const Value& value) {
  Series series{.title = std::string(title), .color = color, .x = {}, .y = {}};
  series.style = SeriesStyle::kPoints;
  for (const TradeoffPoint* p : points) {
    series.x.push_back(p->seconds);
    series.y.push_back(value(*p));
    series.labels.push_back(short_name(*p));
  }
  return series;
}

/// What nothing beats in seconds and in this value, by seconds.
Series front_of(Points points, const Value& value) {
  std::ranges::sort(points, {}, [](const TradeoffPoint* p) { return p->seconds; });
  Series front{.title = "front", .color = "#666666", .x = {}, .y = {}};
  for (const TradeoffPoint* p : points) {
    if (!front.y.empty() && value(*p) >= front.y.back()) continue;
    front.x.push_back(p->seconds);
    front.y.push_back(value(*p));
  }
  front.style = SeriesStyle::kSteps;
  return front;
}

CurvePlot plot_of(const Points& points, std::string y_label, const Value& value) {
  CurvePlot plot{.x_label = "seconds",
                 .y_label = std::move(y_label),
                 .log_y = true,
                 .series = {front_of(points, value)},
                 .level_title = {}};
  plot.log_x = true;
  plot.width = kWidth;
  plot.height = kHeight;
  for (const auto& [dial, color] : groups_of(points)) {
    Points some;
    std::ranges::copy_if(points, std::back_inserter(some), [dial = dial](const TradeoffPoint* p) {
      return group_of(*p) == dial;
    });
    if (!some.empty()) plot.series.push_back(series_of(some, dial, color, value));
  }
  return plot;
}

}  // namespace

Result<std::string> tradeoff_svg(const std::vector<TradeoffPoint>& points, std::stop_token stop) {
  Points good;
  Points judged;
  for (const TradeoffPoint& p : points) {
    if (!p.failed.empty()) continue;
    good.push_back(&p);
    if (p.bssrdf_error) judged.push_back(&p);
  }
  if (good.empty()) return invalid_argument("nothing to draw: no setting came to a figure");
  CurvePlot relighting = plot_of(good, "relighting error, held-out lights, %", [](const auto& p) {
    return 100.0 * p.held_out.error;
  });
  relighting.level = 100.0 * good.front()->held_out.noise_floor;
  relighting.level_title = "noise alone";
  const auto upper = draw(relighting, "relighting", stop);
  if (!upper) return upper.error();
  std::vector<std::string> drawings{*upper};
  if (!judged.empty()) {
    const auto lower =
        draw(plot_of(judged, "BSSRDF error E", [](const auto& p) { return *p.bssrdf_error; }),
             "bssrdf",
             stop);
    if (!lower) return lower.error();
    drawings.push_back(*lower);
  }
  return svg_file(drawings, kWidth, kHeight);
}

}  // namespace opaline::daemon
