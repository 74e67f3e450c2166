#include <fmt/format.h>

#include "daemon/report/report_data.h"

namespace opaline::daemon {
namespace {

std::string boundary(reconstruct::diffusion::BoundaryModel model) {
  using reconstruct::diffusion::BoundaryModel;
  switch (model) {
    case BoundaryModel::kTwoMoment:
      return "two_moment: partial currents with both Fresnel moments (Haskell et al. 1994)";
    case BoundaryModel::kJensen:
      return "jensen: A = (1 + Fdr) / (1 - Fdr) (Jensen et al. 2001)";
    case BoundaryModel::kKeijzer:
      return "keijzer: closed form (Keijzer et al. 1988)";
    case BoundaryModel::kMilne:
      return "milne: two_moment with the extrapolation length of Milne's problem (Hopf 1934)";
  }
  return "";
}

std::string source(const reconstruct::InverseOptions& options) {
  using reconstruct::diffusion::SourceModel;
  const std::string chosen = options.choose_source ? ", as the pictures asked for" : "";
  return (options.source == SourceModel::kCollimated
              ? "collimated: first scattering along the perpendicular ray"
              : "surface: diffuse light enters at the boundary") +
         chosen;
}

std::string calibration(const ReportData& data) {
  if (data.facts.calibration.empty()) {
    return data.config.rig.is_simulated() ? "of a simulated station, read from the rig file"
                                          : "read from the rig file, not measured in this session";
  }
  std::string text = "measured: " + data.facts.calibration;
  for (const std::string& warning : data.facts.calibration_warnings)
    text += "; DOUBTFUL: " + warning;
  return text;
}

std::string left_out(const ReportData& data) {
  if (data.dataset.lit_face != data.dataset.seen_face) return "nothing: another face is seen";
  return fmt::format("{:.2f} mm: {} transport mean free paths",
                     data.reconstruction.value("direct_light_margin_mm", 0.0),
                     data.config.reconstruction.direct_light_paths);
}

}  // namespace

std::vector<std::pair<std::string, std::string>> assumptions(const ReportData& data) {
  const reconstruct::InverseOptions& options = data.config.reconstruction;
  const Vec3 size = data.dataset.block.size();
  return {
      {"Equation", "diffusion (P1) of each colour channel by itself, steady light"},
      {"Sample",
       fmt::format("a block of {} x {} x {} mm with smooth faces", size.x, size.y, size.z)},
      {"Refractive index", fmt::format("{}, the same throughout, as given", data.dataset.ior)},
      {"Boundary", boundary(options.boundary)},
      {"Light source", source(options)},
      {"Light enters by", std::string(to_string(data.dataset.lit_face))},
      {"Camera sees", std::string(to_string(data.dataset.seen_face))},
      {"Left out around lit regions", left_out(data)},
      {"Model error",
       fmt::format("{} % of each datum and of its picture, on top of the measured noise",
                   100.0 * options.model_error)},
      {"Smoothness",
       fmt::format("{}, weight {}",
                   options.regularizer == reconstruct::Smoothness::kH1 ? "squared gradients (H1)"
                                                                       : "total variation",
                   options.regularization)},
      {"Calibration", calibration(data)},
      {"Colours of the pictures",
       data.colors ? "sRGB, by the " + data.colors->name() : "the camera's own, not corrected"},
      {"Unscattered light", "left out: it is not part of the diffuse light"},
  };
}

}  // namespace opaline::daemon
