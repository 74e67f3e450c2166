#pragma once

#include <sys/types.h>

#include <chrono>
#include <filesystem>
#include <functional>
#include <map>
#include <string>
#include <vector>

namespace opaline::testing {

/// A child process; killed, if it still runs, at the end of the scope.
class Process {
 public:
  using Environment = std::map<std::string, std::string>;

  /// Both outputs go to `output`.
  Process(const std::vector<std::string>& command,
          const Environment& environment,
          const std::filesystem::path& output);
  ~Process();
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;

  pid_t pid() const { return pid_; }
  void kill(int signal) const;
  bool is_running();
  /// The exit status, 128 + n for a signal; fails the test after a minute.
  int wait();
  std::string output() const;

 private:
  pid_t pid_ = -1;
  int status_ = -1;
  std::filesystem::path output_;
};

/// Looks again and again until the condition holds; false after `deadline`.
bool eventually(const std::function<bool()>& condition,
                std::chrono::milliseconds deadline = std::chrono::minutes(1));

}  // namespace opaline::testing
