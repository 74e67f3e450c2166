#include "daemon/report/external_program.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <spawn.h>
#include <sys/mman.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <csignal>
#include <cstring>

#include "base/file_descriptor.h"

namespace opaline::daemon {
namespace {

using Milliseconds = std::chrono::milliseconds;
constexpr Milliseconds kLook{50};  // how often the stop token is looked at

Result<FileDescriptor> memory_file(std::string_view content) {
  FileDescriptor fd(::memfd_create("opaline", MFD_CLOEXEC));
  if (!fd) return unavailable(fmt::format("memory file: {}", std::strerror(errno)));
  while (!content.empty()) {
    const ssize_t n = ::write(fd.get(), content.data(), content.size());
    if (n < 0) return unavailable(fmt::format("memory file: {}", std::strerror(errno)));
    content.remove_prefix(static_cast<std::size_t>(n));
  }
  ::lseek(fd.get(), 0, SEEK_SET);
  return fd;
}

std::string content_of(const FileDescriptor& fd) {
  std::string text;
  std::array<char, 65536> buffer{};
  ::lseek(fd.get(), 0, SEEK_SET);
  for (ssize_t n = 0; (n = ::read(fd.get(), buffer.data(), buffer.size())) > 0;) {
    text.append(buffer.data(), static_cast<std::size_t>(n));
  }
  return text;
}

/// Standard input, output and error of a child, as files in memory: nobody waits for a pipe.
struct Streams {
  FileDescriptor in, out, err;
};

Result<pid_t> spawn(const std::vector<std::string>& command, const Streams& streams) {
  std::vector<char*> arguments;
  arguments.reserve(command.size() + 1);
  for (const std::string& word : command) arguments.push_back(const_cast<char*>(word.c_str()));
  arguments.push_back(nullptr);
  posix_spawn_file_actions_t actions;
  ::posix_spawn_file_actions_init(&actions);
  ::posix_spawn_file_actions_adddup2(&actions, streams.in.get(), STDIN_FILENO);
  ::posix_spawn_file_actions_adddup2(&actions, streams.out.get(), STDOUT_FILENO);
  ::posix_spawn_file_actions_adddup2(&actions, streams.err.get(), STDERR_FILENO);
  pid_t pid = 0;
  const int failed =
      ::posix_spawnp(&pid, arguments[0], &actions, nullptr, arguments.data(), environ);
  ::posix_spawn_file_actions_destroy(&actions);
  if (failed != 0) {
    return unavailable(fmt::format("cannot run {}: {}", command[0], std::strerror(failed)));
  }
  return pid;
}

/// Waits for the child's end; on an error it has been killed. It is reaped in either case.
Result<int> wait_for(pid_t pid, Milliseconds deadline, const std::stop_token& stop) {
  const FileDescriptor handle(static_cast<int>(::syscall(SYS_pidfd_open, pid, 0)));
  Result<int> status = 0;
  pollfd ended{handle.get(), POLLIN, 0};
  for (Milliseconds waited{}; ::poll(&ended, 1, static_cast<int>(kLook.count())) <= 0;
       waited += kLook) {
    if (stop.stop_requested()) {
      status = cancelled("stopped");
    } else if (waited >= deadline) {
      status = timeout(fmt::format("not ready after {} ms", deadline.count()));
    } else {
      continue;
    }
    ::kill(pid, SIGKILL);
    break;
  }
  int code = 0;
  ::waitpid(pid, &code, 0);
  if (status) status = code;
  return status;
}

}  // namespace

Result<std::string> run_program(const std::vector<std::string>& command,
                                std::string_view input,
                                Milliseconds deadline,
                                std::stop_token stop) {
  auto in = memory_file(input);
  auto out = memory_file("");
  auto err = memory_file("");
  if (!in || !out || !err) return (!in ? in : !out ? out : err).error();
  const Streams streams{*std::move(in), *std::move(out), *std::move(err)};
  const auto pid = spawn(command, streams);
  if (!pid) return pid.error();
  const auto status = wait_for(*pid, deadline, stop);
  if (!status) return status.error().in(command[0]);
  if (!WIFEXITED(*status) || WEXITSTATUS(*status) != 0) {
    return internal_error(
        fmt::format("{} failed: {}", command[0], content_of(streams.err).substr(0, 300)));
  }
  return content_of(streams.out);
}

}  // namespace opaline::daemon
