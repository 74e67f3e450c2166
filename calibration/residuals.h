#pragma once

#include <nlohmann/json.hpp>
#include <span>

#include "calibration/board.h"
#include "calibration/pair_fit.h"

namespace opaline::calibration {

/// Where each kept pose's corners were seen and where camera and projector, as fitted together, would have them: for reports.
///
///   [{"name": "pose 1", "camera": [[x, y, dx, dy], ...], "projector": [...]}, ...]
///
/// x, y in that device's pixels, dx, dy from where the corner should be to where it was seen, to a thousandth. Corners that
/// did not count are there, too.
nlohmann::json residuals_of(const PairFit& fit,
                            const Board& board,
                            std::span<const BoardView> camera_views,
                            std::span<const BoardView> projector_views);

}  // namespace opaline::calibration
