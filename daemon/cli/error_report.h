#pragma once

#include "base/result.h"

namespace opaline::daemon {

/// Says on standard error what went wrong in `opaline`, if anything did; the exit status.
int report(const Error& error);
int report(const Result<void>& done);

}  // namespace opaline::daemon
