#pragma once

#include "base/pose.h"
#include "config/fields.h"

namespace opaline::config {

/// The keys "rotation" and "translation" of a pose.
void visit_pose(Fields& fields, Pose& pose);

}  // namespace opaline::config
