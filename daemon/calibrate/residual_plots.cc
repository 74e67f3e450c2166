#include "daemon/calibrate/residual_plots.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "daemon/report/html.h"

namespace opaline::daemon {
namespace {

constexpr int kTitleHeight = 18;
constexpr int kPanelGap = 10;
constexpr int kScaleHeight = 30;
constexpr double kLongestArrow = 6.0;  // typical ones

std::vector<CornerResidual> corner_list(const nlohmann::json& list) {
  std::vector<CornerResidual> residuals;
  if (!list.is_array()) return residuals;
  for (const auto& one : list) {
    const bool good = one.is_array() && one.size() == 4 &&
                      std::ranges::all_of(one, [](const auto& v) { return v.is_number(); });
    if (good)
      residuals.push_back(
          {one[0].get<double>(), one[1].get<double>(), one[2].get<double>(), one[3].get<double>()});
  }
  return residuals;
}

// A line with a dot at its foot: an arrow's head would hide a short one.
std::string arrow(const CornerResidual& r, double scale, double magnification, double typical_px) {
  const double length = std::hypot(r.dx, r.dy);
  const bool long_one = length > kLongestArrow * typical_px;
  const double shown =
      long_one ? magnification * kLongestArrow * typical_px / length : magnification;
  return fmt::format(
      "<line x1=\"{:.1f}\" y1=\"{:.1f}\" x2=\"{:.1f}\" y2=\"{:.1f}\" stroke=\"{}\"/>"
      "<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"0.9\"/>",
      scale * r.x,
      scale * r.y,
      scale * r.x + shown * r.dx,
      scale * r.y + shown * r.dy,
      long_one ? "#c0392b" : "#2b5fc0",
      scale * r.x,
      scale * r.y);
}

// Arrows end at the panel's edge.
std::string panel_svg(const ResidualPanel& panel, int left, int top, const ResidualLayout& layout) {
  const int width = layout.panel_width;
  const double scale = static_cast<double>(width) / std::max(1, panel.size[0]);
  const int height = static_cast<int>(scale * panel.size[1]);
  std::string svg = fmt::format(
      "<text x=\"{0}\" y=\"{1}\" font-size=\"11\">{2}</text>"
      "<svg x=\"{0}\" y=\"{3}\" width=\"{4}\" height=\"{5}\" stroke-width=\"0.9\">"
      "<rect width=\"{4}\" height=\"{5}\" fill=\"#fafafa\" stroke=\"#999\"/>",
      left,
      top - 5,
      html::escaped(panel.title),
      top,
      width,
      height);
  for (const CornerResidual& r : panel.residuals)
    svg += arrow(r, scale, layout.arrow / layout.typical_px, layout.typical_px);
  return svg + "</svg>";
}

std::string scale_svg(int top, const ResidualLayout& layout) {
  constexpr double kTimes = 3.0;
  return fmt::format(
      "<g transform=\"translate(2,{})\"><line x2=\"{:.1f}\" stroke=\"#2b5fc0\" stroke-width=\"2\"/>"
      "<text x=\"{:.1f}\" y=\"4\" font-size=\"11\">{:.2g} px; red: cut at {:.2g} px</text></g>",
      top,
      kTimes * layout.arrow,
      kTimes * layout.arrow + 8.0,
      kTimes * layout.typical_px,
      kLongestArrow * layout.typical_px);
}

}  // namespace

std::vector<PoseResiduals> pose_residuals(const nlohmann::json& residuals) {
  std::vector<PoseResiduals> poses;
  if (!residuals.is_array()) return poses;
  for (const auto& pose : residuals) {
    if (!pose.is_object()) continue;
    poses.push_back({pose.value("name", ""),
                     corner_list(pose.value("camera", nlohmann::json())),
                     corner_list(pose.value("projector", nlohmann::json()))});
  }
  return poses;
}

double residual_rms(const std::vector<CornerResidual>& residuals) {
  double sum = 0.0;
  for (const CornerResidual& r : residuals) sum += r.dx * r.dx + r.dy * r.dy;
  return residuals.empty() ? 0.0 : std::sqrt(sum / static_cast<double>(residuals.size()));
}

std::string residual_svg(const std::vector<ResidualPanel>& panels, const ResidualLayout& layout) {
  if (panels.empty() || !(layout.typical_px > 0.0)) return {};
  int tallest = 1;
  for (const ResidualPanel& p : panels)
    tallest = std::max(tallest, layout.panel_width * p.size[1] / std::max(1, p.size[0]));
  const int count = static_cast<int>(panels.size());
  const int across = std::min(layout.columns, count);
  const int rows = (count + across - 1) / across;
  const int row_height = tallest + kTitleHeight + kPanelGap;
  const int width = across * (layout.panel_width + kPanelGap) + 2;
  std::string svg = fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{0}\" viewBox=\"0 0 {0} {1}\" "
      "font-family=\"sans-serif\" fill=\"#222\">",
      width,
      rows * row_height + kScaleHeight);
  for (int i = 0; i < count; ++i)
    svg += panel_svg(panels[static_cast<std::size_t>(i)],
                     1 + i % across * (layout.panel_width + kPanelGap),
                     kTitleHeight + i / across * row_height,
                     layout);
  return svg + scale_svg(rows * row_height + kScaleHeight / 2, layout) + "</svg>";
}

}  // namespace opaline::daemon
