#pragma once

#include <array>

#include "base/pose.h"

namespace opaline::render {

/// R_z R_y R_x: about x first, then y, then z.
Pose turned_about_axes(const std::array<double, 3>& degrees);

/// First one, then the other.
Pose chained(const Pose& second, const Pose& first);

}  // namespace opaline::render
