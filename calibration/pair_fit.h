#pragma once

#include <array>
#include <span>
#include <stop_token>
#include <vector>

#include "calibration/lens_fit.h"

namespace opaline::calibration {

/// Camera and projector together.
struct PairFit {
  LensFit camera;     ///< of the camera alone
  LensFit projector;  ///< of the projector alone
  CameraModel joint_camera;
  CameraModel joint_projector;  ///< camera_from_sample: projector_from_camera
  std::array<LensDeviation, 2> deviation{};
  std::array<double, 6> place_deviation{};  ///< of the projector: rad, mm
  double stereo_rms_px = 0.0;  ///< of both lenses' corners, each board in one place for both
  double worst_view_px = 0.0;
  double median_view_px = 0.0;
  std::vector<ViewFit> views;  ///< rms_px of both lenses
  int kept() const;
};

/// The same board seen by a camera and, as an inverse camera, by a projector (Moreno & Taubin 2012): the lenses each alone, the
/// projector's place from the poses that both tell, then both lenses, its place and all poses in one adjustment, each lens's
/// corners weighted by how well they fit alone. Views are aligned; one that either could not use, or in which the two
/// disagree, is left out by name. Errors: as fit_lens().
Result<PairFit> fit_pair(std::array<int, 2> camera_size,
                         std::array<int, 2> projector_size,
                         const Board& board,
                         std::span<const BoardView> camera_views,
                         std::span<const BoardView> projector_views,
                         const LensFitOptions& options,
                         std::stop_token stop);

/// The ends' distance on each kept view's rows of corners, both ends triangulated from camera and projector (the point nearest
/// to both rays), mm: what a known length is compared with. One a row of which both ends were seen.
std::vector<double> row_lengths(const PairFit& fit,
                                const Board& board,
                                std::span<const BoardView> camera_views,
                                std::span<const BoardView> projector_views);

}  // namespace opaline::calibration
