#pragma once

#include <sys/types.h>

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/result.h"

namespace opaline::daemon {

/// A stage's program to be run on a session.
struct JobCommand {
  std::string stage;                        ///< "capture" runs opaline-capture
  std::filesystem::path directory;          ///< the session's, where job.log is
  std::vector<std::string> arguments = {};  ///< empty: the directory
};

/// A job that was started here. Letting go of it leaves the job running.
class JobProcess {
 public:
  virtual ~JobProcess() = default;
  /// The exit status once it has ended, 128 + n when signal n ended it.
  virtual std::optional<int> poll_exit() = 0;
  /// Its number, ours to signal until poll_exit() has seen the end; nothing when it runs elsewhere.
  virtual std::optional<pid_t> pid() const = 0;
};

/// Where jobs run.
class Executor {
 public:
  virtual ~Executor() = default;
  /// Errors: kNotFound when the program is not there, kUnavailable when no process can be made.
  virtual Result<std::unique_ptr<JobProcess>> start(const JobCommand& command) = 0;
};

/// Processes of this machine, each in a session of its own so that it outlives whoever started it;
/// what they print is appended to job.log in the session directory.
class LocalExecutor : public Executor {
 public:
  /// `programs` holds opaline-capture and its siblings.
  explicit LocalExecutor(std::filesystem::path programs) : programs_(std::move(programs)) {}
  Result<std::unique_ptr<JobProcess>> start(const JobCommand& command) override;

 private:
  std::filesystem::path programs_;
};

/// The directory of the running program, where its siblings are.
std::filesystem::path program_directory();

}  // namespace opaline::daemon
