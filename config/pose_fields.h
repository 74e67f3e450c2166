#pragma once

#include <string_view>

#include "base/pose.h"
#include "config/fields.h"

namespace opaline::config {

/// The keys "rotation" and "translation" of a pose, which takes one frame into another.
void visit_pose(Fields& fields,
                Pose& pose,
                std::string_view from = "sample",
                std::string_view to = "camera");

}  // namespace opaline::config
