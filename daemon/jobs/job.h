#pragma once

#include <functional>
#include <stop_token>
#include <string>

#include "base/events.h"
#include "base/files.h"
#include "base/result.h"
#include "base/session_directory.h"

namespace opaline::daemon {

/// What tells one job's program from another's.
struct JobDescription {
  std::string name;     ///< the stage: "capture" for opaline-capture
  std::string summary;  ///< one line for --help
};

/// What a job works with; everything outlives the body's run.
struct JobContext {
  const SessionDirectory& session;  ///< locked by this process
  EventSink& events;                ///< facts go to the session's log, progress is thinned to 5 Hz
  FileOperations& files;
  std::stop_token stop;  ///< set by SIGTERM, SIGINT and a "cancel" over control.sock
};

using JobBody = std::function<Result<void>(JobContext&)>;

/// The main of every job: `opaline-STAGE SESSION_DIR`.
///
///   open the session (its format version is checked) -> take its kernel lock -> open the event log
///   -> job.started {"job","pid","version"} -> body -> job.finished {"job","outcome","message",...}
///
/// job.finished carries "outcome": succeeded, failed or cancelled; "message"; when it did not
/// succeed "code", the error's; and when it was cancelled "by": "request" (control.sock or SIGINT)
/// or "signal" (SIGTERM: the machine wants it to stop, so a supervisor goes on with it later).
///
/// The body does what is not yet done and returns kCancelled soon after a stop; kBusy says that the
/// station is in use and the stage should be tried again. What it throws is caught and reported.
///
/// Returns ProgramExit (daemon/jobs/program.h): 2 for bad usage, a directory that is no session or of a newer version, and a
/// body's kInvalidArgument or kNotFound; 4 when another job holds the session.
/// SIGTERM and SIGINT are handled from here on; a child that is only forked inherits the handlers.
int run_job(int argc, char** argv, const JobDescription& job, const JobBody& body);

}  // namespace opaline::daemon
