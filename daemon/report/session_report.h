#pragma once

#include "base/result.h"
#include "daemon/jobs/job.h"
#include "gpu/context.h"

namespace opaline::daemon {

/// What opaline-preview does with a session whose material has been found: relights the held-out
/// lights, writes preview/NAME-{captured,relit,difference}.png and preview/NAME-{captured,relit}.exr,
/// an object of the material (daemon/preview/session_object.h), results.json, and report.html last.
///
/// Reads: resolved.toml, dataset.*, material.vdb, reconstruction.json, hdr/*.exr, events.jsonl, and
/// of a simulated station its stored light transport.
/// Progress: "lighting", "relighting", "BSSRDF error", "object", "report". Fact: preview.completed
/// {relighting_error?, noise_floor?, bssrdf_error?}: without held-out lights that can be used there
/// are no relit pictures. Pictures are drawn through Vulkan, or by rays on the host where there is no device; the report says which. A plot that cannot be drawn leaves a note in the report.
/// Errors: those of the files, the solver and the renderer; kCancelled.
Result<void> report_session(JobContext& job, const gpu::ContextOptions& gpu = {});

}  // namespace opaline::daemon
