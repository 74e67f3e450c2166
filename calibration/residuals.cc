#include "calibration/residuals.h"

#include <cmath>

namespace opaline::calibration {
namespace {

double thousandths(double value) { return std::round(1000.0 * value) / 1000.0; }

nlohmann::json view_residuals(const CameraModel& lens,
                              const Pose& camera_from_board,
                              const Board& board,
                              const BoardView& view) {
  nlohmann::json list = nlohmann::json::array();
  for (const BoardCorner& corner : view.corners) {
    const auto expected = lens.project(camera_from_board.apply(board.corner(corner.id)));
    list.push_back({thousandths(corner.pixel.x),
                    thousandths(corner.pixel.y),
                    thousandths(corner.pixel.x - expected.x),
                    thousandths(corner.pixel.y - expected.y)});
  }
  return list;
}

}  // namespace

nlohmann::json residuals_of(const PairFit& fit,
                            const Board& board,
                            std::span<const BoardView> camera_views,
                            std::span<const BoardView> projector_views) {
  nlohmann::json all = nlohmann::json::array();
  for (std::size_t v = 0; v < fit.views.size(); ++v) {
    const ViewFit& view = fit.views[v];
    if (!view.kept()) continue;
    all.push_back(
        {{"name", view.name},
         {"camera",
          view_residuals(fit.joint_camera, view.camera_from_board, board, camera_views[v])},
         {"projector",
          view_residuals(fit.joint_projector, view.camera_from_board, board, projector_views[v])}});
  }
  return all;
}

}  // namespace opaline::calibration
