#pragma once

#include "base/result.h"
#include "daemon/jobs/job.h"

namespace opaline::daemon {

/// What opaline-preview does for an object in a sphere of lights: PNG views of its pictures and maps in preview/, results.json and report.html.
/// On a simulated stage the truth stands beside what was found.
/// Errors: kNotFound, kInvalidArgument for what the stages before left; kUnavailable; kCancelled.
Result<void> report_sphere(JobContext& job);

}  // namespace opaline::daemon
