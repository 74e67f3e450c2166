#pragma once

#include <array>
#include <optional>
#include <span>

#include "base/camera_model.h"

namespace opaline::calibration {

/// A plane seen in another: (u, v, w) ~ h (x, y, 1), row-major, h[8] = 1 where it can be.
using Homography = std::array<double, 9>;

struct PlanePair {
  CameraModel::Pixel from;
  CameraModel::Pixel to;
  double weight = 1.0;
};

/// By the normalised direct linear transform (Hartley & Zisserman 2004, algorithm 4.2): four pairs or more, least squares of
/// the algebraic distance. None where the points do not determine one.
std::optional<Homography> fit_homography(std::span<const PlanePair> pairs);

CameraModel::Pixel carry(const Homography& h, CameraModel::Pixel from);

}  // namespace opaline::calibration
