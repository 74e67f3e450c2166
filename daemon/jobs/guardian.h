#pragma once

#include <sys/types.h>

#include <chrono>
#include <filesystem>
#include <functional>
#include <memory>
#include <stop_token>
#include <thread>

#include "base/file_descriptor.h"
#include "base/result.h"

namespace opaline::daemon {

/// A process that outlives the job and makes its light source dark: opaline-guardian, held on a pipe whose other end
/// only the job has. When the job dies, however it dies, the kernel closes the pipe, and the light is dark within a
/// second; so it is when the job lets go of this object.
///
///   job: start() ── "ready" ◄── guardian: has read the session, holds the station's guardian lock
///   job dies or lets go ──► guardian: dark(), tried again for ten seconds, then ends
///
/// The guardian is in a session of its own and ignores SIGINT, SIGTERM and SIGHUP, so that what is meant for the job
/// does not reach it. One guardian a station: the next job's waits for it, so a light is never darkened late.
class Guardian {
 public:
  /// `program` is run as PROGRAM SESSION_DIR. Waits up to 15 s for "ready". Errors: kUnavailable, kTimeout, kCancelled.
  static Result<std::unique_ptr<Guardian>> start(const std::filesystem::path& program,
                                                 const std::filesystem::path& session,
                                                 std::stop_token stop);
  /// Lets go, and waits until the guardian has ended, 15 s at most.
  ~Guardian();
  Guardian(const Guardian&) = delete;
  Guardian& operator=(const Guardian&) = delete;

  pid_t pid() const { return pid_; }
  /// Stop is requested when the guardian dies before it was let go: the light has nobody to watch it.
  std::stop_token death() const { return death_.get_token(); }

 private:
  Guardian(pid_t pid, FileDescriptor process, FileDescriptor hold);
  pid_t pid_;
  FileDescriptor process_;  // a pidfd
  FileDescriptor hold_;     // closing it ends the guardian
  std::stop_source death_;
  std::jthread watcher_;
};

/// The guardian's side: takes the lock, says "ready" on standard output, waits until standard input ends, and makes
/// dark. Returns the exit status: 0 when the light is dark.
int guard(const std::filesystem::path& lock, const std::function<Result<void>()>& dark);

/// The lock of the station's guardian.
std::filesystem::path guardian_lock_path(std::string_view station);

}  // namespace opaline::daemon
