#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "calibration/response_pixels.h"

namespace opaline::calibration {

inline constexpr int kResponseKnots = 65;

/// h of fit_response() at a fraction of the range, among its unknowns: h at the knots, then the errors of the times.
double response_between(const Eigen::VectorXd& unknowns, double fraction);

/// The least squares of fit_response(), with pixels trusted by their own residuals in some rounds.
Eigen::VectorXd solve_response(std::vector<ResponsePixel>& pixels, std::span<const Exposure> stack);

}  // namespace opaline::calibration
