#pragma once

#include "base/result.h"
#include "config/rig_config.h"
#include "config/toml.h"

namespace opaline::config {

/// The text of a rig file by itself. A relative path in a source without a directory is a problem.
/// Errors: kInvalidArgument with every problem, one a line: FILE:LINE:COLUMN: what is wrong, and what would be right.
Result<RigConfig> parse_rig(const Source& source);

}  // namespace opaline::config
