#include "daemon/calibrate/patch_swatches.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "calibration/color_difference.h"
#include "daemon/report/html.h"

namespace opaline::daemon {
namespace {

using calibration::Lab;

constexpr int kPatchesAcross = 6;
constexpr int kSide = 76;
constexpr int kApart = 6;
constexpr int kInner = 40;

// From CIE XYZ under D50 to linear sRGB, its white at D65 by Bradford's adaptation (Lindbloom).
constexpr std::array<std::array<double, 3>, 3> kSrgbFromXyz{{{3.1338561, -1.6168667, -0.4906146},
                                                             {-0.9787684, 1.9161415, 0.0334540},
                                                             {0.0719453, -0.2289914, 1.4052427}}};

std::string hex_of(const Lab& lab) {
  const calibration::Xyz xyz = calibration::xyz_from_lab(lab);
  std::string text = "#";
  for (const auto& row : kSrgbFromXyz) {
    const double linear = std::clamp(row[0] * xyz[0] + row[1] * xyz[1] + row[2] * xyz[2], 0.0, 1.0);
    const double shown =
        linear <= 0.0031308 ? 12.92 * linear : 1.055 * std::pow(linear, 1.0 / 2.4) - 0.055;
    text += fmt::format("{:02x}", std::lround(255.0 * shown));
  }
  return text;
}

std::string swatch(int index, const std::string& name, const Lab& published, const Lab& seen) {
  const int inset = (kSide - kInner) / 2;
  return fmt::format(
      "<g transform=\"translate({},{})\"><title>{}</title>"
      "<rect width=\"{}\" height=\"{}\" fill=\"{}\"/>"
      "<rect x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\" fill=\"{}\"/>"
      "<text x=\"3\" y=\"{}\" font-size=\"11\" fill=\"{}\">{:.2f}</text></g>",
      index % kPatchesAcross * (kSide + kApart),
      index / kPatchesAcross * (kSide + kApart),
      html::escaped(name),
      kSide,
      kSide,
      hex_of(published),
      inset,
      inset,
      kInner,
      kInner,
      hex_of(seen),
      kSide - 4,
      published[0] > 50.0 ? "#000" : "#fff",
      calibration::delta_e_2000(published, seen));
}

}  // namespace

std::string patch_swatches(const calibration::Record& record) {
  const calibration::StepRecord* const step = record.find("colour");
  const auto patches =
      step == nullptr ? nlohmann::json() : step->values.value("patches", nlohmann::json());
  if (!patches.is_array() || patches.empty()) return {};
  const int rows = (static_cast<int>(patches.size()) + kPatchesAcross - 1) / kPatchesAcross;
  std::string svg = fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{0}\" viewBox=\"0 0 {0} {1}\" "
      "font-family=\"sans-serif\">",
      kPatchesAcross * (kSide + kApart),
      rows * (kSide + kApart));
  int index = 0;
  for (const auto& patch : patches) {
    if (!patch.is_object() || !patch.contains("lab") || !patch.contains("seen_lab")) return {};
    svg += swatch(
        index++, patch.value("patch", ""), patch["lab"].get<Lab>(), patch["seen_lab"].get<Lab>());
  }
  return html::drawing(svg + "</svg>",
                       "Each patch as published, and within it as the corrected camera sees it, "
                       "with CIEDE2000 of the fit itself");
}

}  // namespace opaline::daemon
