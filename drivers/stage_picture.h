#pragma once

#include "base/result.h"
#include "drivers/light_stage.h"
#include "drivers/projector.h"

namespace opaline::drivers {

/// A light stage looked at as a projector: N lights are a picture of (N + 1) x 1 pixels, pixel n light n, alike in all three channels; the
/// last pixel is the polariser, 0 crossed, 255 parallel. So what takes, stores and proves pictures of a projector's patterns does it for a
/// stage's too.
Pattern stage_picture(const StagePattern& pattern);

/// The way back. Errors: kInvalidArgument for what is no such picture.
Result<StagePattern> stage_pattern(const Pattern& picture);

}  // namespace opaline::drivers
