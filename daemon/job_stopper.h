#pragma once

#include <sys/types.h>

#include <chrono>
#include <optional>

#include "base/clock.h"
#include "base/file_descriptor.h"
#include "base/session_directory.h"

namespace opaline::daemon {

/// Makes a session's job stop, whatever state it is in:
///
///   asked over control.sock, again until it answers  ->  SIGTERM  ->  SIGKILL
///
/// The process is the one started here, or the one that listens at control.sock, which the kernel
/// names even when it is stopped or was started by another daemon. It is held by a pidfd, and
/// signalled only when the session's lock was still held after that was opened, so that a signal
/// reaches no stranger that got its number. Threads: one at a time.
class JobStopper {
 public:
  struct Options {
    std::chrono::nanoseconds period = std::chrono::seconds(1);  ///< between two attempts
    std::chrono::nanoseconds terminate_after = std::chrono::seconds(5);
    std::chrono::nanoseconds kill_after = std::chrono::seconds(15);
  };
  JobStopper(const Options& options, const Clock& clock) : options_(options), clock_(&clock) {}

  /// To be called again and again while the job should stop and has not; does the next thing when
  /// its time has come, which takes 0.3 s at most. `child`: the job's process, if started here.
  /// `asked`: the job has answered already.
  void step(const SessionDirectory& session, std::optional<pid_t> child, bool asked);
  /// Nothing is to be stopped, or not any more: the next step() begins anew.
  void reset();

 private:
  void ask(const SessionDirectory& session);
  void signal(const SessionDirectory& session, int number);

  Options options_;
  const Clock* clock_;  // outlives us
  std::optional<std::chrono::nanoseconds> since_;
  std::chrono::nanoseconds next_{};
  bool answered_ = false;
  int signalled_ = 0;
  FileDescriptor process_;  // a pidfd
};

}  // namespace opaline::daemon
