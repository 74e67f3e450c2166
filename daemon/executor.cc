#include "daemon/executor.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstdio>
#include <system_error>

namespace opaline::daemon {
namespace {

namespace fs = std::filesystem;

class LocalProcess final : public JobProcess {
 public:
  explicit LocalProcess(pid_t pid) : pid_(pid) {}

  std::optional<int> poll_exit() override {
    if (exit_) return exit_;
    int status = 0;
    const pid_t ended = ::waitpid(pid_, &status, WNOHANG);
    if (ended == 0 || (ended < 0 && errno == EINTR)) return std::nullopt;
    exit_ = ended > 0 && WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
    return exit_;
  }
  std::optional<pid_t> pid() const override {
    return exit_ ? std::nullopt : std::optional<pid_t>(pid_);
  }

 private:
  pid_t pid_;
  std::optional<int> exit_;
};

/// What posix_spawn needs: a session of its own, no signal blocked or ignored, output to a file,
/// and nothing else open that is open here.
class SpawnSettings {
 public:
  explicit SpawnSettings(const fs::path& log) {
    ::posix_spawnattr_init(&attributes);
    ::posix_spawnattr_setflags(&attributes,
                               POSIX_SPAWN_SETSID | POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF);
    sigset_t signals;
    sigemptyset(&signals);
    ::posix_spawnattr_setsigmask(&attributes, &signals);
    for (const int signal : {SIGTERM, SIGINT, SIGHUP, SIGPIPE}) sigaddset(&signals, signal);
    ::posix_spawnattr_setsigdefault(&attributes, &signals);
    ::posix_spawn_file_actions_init(&actions);
    ::posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
    ::posix_spawn_file_actions_addopen(
        &actions, STDOUT_FILENO, log.c_str(), O_WRONLY | O_CREAT | O_APPEND, 0644);
    ::posix_spawn_file_actions_adddup2(&actions, STDOUT_FILENO, STDERR_FILENO);
    ::posix_spawn_file_actions_addclosefrom_np(&actions, STDERR_FILENO + 1);
  }
  ~SpawnSettings() {
    ::posix_spawnattr_destroy(&attributes);
    ::posix_spawn_file_actions_destroy(&actions);
  }
  SpawnSettings(const SpawnSettings&) = delete;
  SpawnSettings& operator=(const SpawnSettings&) = delete;

  posix_spawnattr_t attributes{};
  posix_spawn_file_actions_t actions{};
};

}  // namespace

Result<std::unique_ptr<JobProcess>> LocalExecutor::start(const JobCommand& command) {
  const std::string program = (programs_ / ("opaline-" + command.stage)).string();
  std::vector<std::string> words = command.arguments;
  if (words.empty()) words.push_back(command.directory.string());
  words.insert(words.begin(), program);
  std::vector<char*> pointers;
  pointers.reserve(words.size() + 1);
  for (std::string& word : words) pointers.push_back(word.data());
  pointers.push_back(nullptr);
  const SpawnSettings settings(command.directory / "job.log");
  pid_t pid = 0;
  const int code = ::posix_spawn(
      &pid, program.c_str(), &settings.actions, &settings.attributes, pointers.data(), environ);
  if (code != 0) {
    std::string message =
        fmt::format("cannot start {}: {}", program, std::generic_category().message(code));
    return code == ENOENT ? not_found(std::move(message)) : unavailable(std::move(message));
  }
  return std::unique_ptr<JobProcess>(std::make_unique<LocalProcess>(pid));
}

fs::path program_directory() {
  std::error_code none;
  const fs::path program = fs::read_symlink("/proc/self/exe", none);
  return none ? fs::path(".") : program.parent_path();
}

}  // namespace opaline::daemon
