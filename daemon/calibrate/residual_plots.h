#pragma once

#include <array>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace opaline::daemon {

/// A corner and what is left of it, px: from where it should be to where it was seen.
struct CornerResidual {
  double x = 0.0;
  double y = 0.0;
  double dx = 0.0;
  double dy = 0.0;
};

/// One pose as calibration/residuals.h writes it down.
struct PoseResiduals {
  std::string name;
  std::vector<CornerResidual> camera;
  std::vector<CornerResidual> projector;
};
/// What is no such list gives none.
std::vector<PoseResiduals> pose_residuals(const nlohmann::json& residuals);

double residual_rms(const std::vector<CornerResidual>& residuals);

/// A device's picture, and what is left of corners in it as arrows.
struct ResidualPanel {
  std::string title;
  std::array<int, 2> size{};  ///< of the picture, px
  std::vector<CornerResidual> residuals;
};
/// How they are drawn.
struct ResidualLayout {
  int columns = 2;
  int panel_width = 430;  ///< px of the drawing, as the next one
  double arrow = 9.0;     ///< of a residual of typical_px
  double typical_px = 0.1;
};
/// SVG: panels beside and below each other, all arrows under one scale, which stands below.
std::string residual_svg(const std::vector<ResidualPanel>& panels, const ResidualLayout& layout);

}  // namespace opaline::daemon
