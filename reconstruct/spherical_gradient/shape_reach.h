#pragma once

#include "reconstruct/spherical_gradient/scattering_maps.h"

namespace opaline::reconstruct {

/// What a pixel's answer owes to the shape around it, as far as light reaches there. The table is of balls, which bend everywhere alike; elsewhere
///
///   - the curvature's spread within 0.7 l_d around a pixel, relative to its own, counts as a deviation of ln D: standard deviation of H over that square, and
///     the difference of its mean from the pixel's, less twice the variance stated already: noise makes that of both; beyond 0.5 the pixel is left out (LeftOut::kUneven);
///   - a certainly concave place within 2 l_d leaves the pixel out (LeftOut::kInterreflection): it sends light of its own, and bends the other way.
///
/// Sums over squares by summed areas (curvature_blocks.h), so the time does not depend on l_d. Threads: as `team`.
void account_for_shape(const GradientPictures& pictures, ThreadTeam& team, ScatteringMaps& maps);

}  // namespace opaline::reconstruct
