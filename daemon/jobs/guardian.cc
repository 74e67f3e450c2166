#include "daemon/jobs/guardian.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <spawn.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <csignal>
#include <string>
#include <system_error>
#include <utility>

#include "base/clock.h"
#include "base/lock.h"
#include "base/log.h"
#include "daemon/jobs/station_lock.h"

namespace opaline::daemon {
namespace {

using namespace std::chrono_literals;
using Time = std::chrono::steady_clock;

constexpr auto kReadyPatience = 15s;
constexpr auto kEndPatience = 15s;
constexpr auto kDarkPatience = 10s;
constexpr char kReady = 'r';

Error system_error(std::string_view doing) {
  return unavailable(
      fmt::format("guardian: {}: {}", doing, std::generic_category().message(errno)));
}

// A pidfd. glibc 2.36 declares pidfd_open() for C only.
int open_process(pid_t pid) { return static_cast<int>(::syscall(SYS_pidfd_open, pid, 0)); }

struct Pipe {
  FileDescriptor read;
  FileDescriptor write;
};

Result<Pipe> make_pipe() {
  std::array<int, 2> ends{};
  if (::pipe2(ends.data(), O_CLOEXEC) != 0) return system_error("pipe");
  return Pipe{FileDescriptor(ends[0]), FileDescriptor(ends[1])};
}

/// posix_spawn's settings, which want destroying: a session of its own, ends of pipes as 0 and 1.
class Spawn {
 public:
  Spawn(int standard_input, int standard_output) {
    ::posix_spawn_file_actions_init(&actions_);
    ::posix_spawnattr_init(&attributes_);
    ::posix_spawn_file_actions_adddup2(&actions_, standard_input, 0);
    ::posix_spawn_file_actions_adddup2(&actions_, standard_output, 1);
    ::posix_spawn_file_actions_addclosefrom_np(&actions_, 3);
    ::posix_spawnattr_setflags(&attributes_, POSIX_SPAWN_SETSID);
  }
  ~Spawn() {
    ::posix_spawn_file_actions_destroy(&actions_);
    ::posix_spawnattr_destroy(&attributes_);
  }
  Spawn(const Spawn&) = delete;
  Spawn& operator=(const Spawn&) = delete;

  Result<pid_t> run(std::string program, std::string argument) const {
    std::array<char*, 3> argv{program.data(), argument.data(), nullptr};
    pid_t pid = 0;
    const int failed =
        ::posix_spawn(&pid, program.c_str(), &actions_, &attributes_, argv.data(), environ);
    if (failed == 0) return pid;
    return unavailable(
        fmt::format("cannot start the guardian {}, and without one no light is switched on: {}",
                    program,
                    std::generic_category().message(failed)));
  }

 private:
  posix_spawn_file_actions_t actions_{};
  posix_spawnattr_t attributes_{};
};

// Waits for something to read, or the end, in steps that look at the stop request.
Result<void> wait_readable(int fd, Time::time_point deadline, const std::stop_token& stop) {
  for (;;) {
    pollfd poll{fd, POLLIN, 0};
    const int ready = ::poll(&poll, 1, 20);
    if (ready > 0) return ok();
    if (ready < 0 && errno != EINTR) return system_error("poll");
    if (stop.stop_requested()) return cancelled("while the guardian was starting");
    if (Time::now() >= deadline) return timeout("the guardian does not get ready");
  }
}

void block_until_end_of_input() {
  std::array<char, 64> ignored{};
  for (;;) {
    const ssize_t n = ::read(0, ignored.data(), ignored.size());
    if (n == 0 || (n < 0 && errno != EINTR)) return;
  }
}

// The one before may still be making dark.
Result<FileLock> acquire_patiently(const std::filesystem::path& path) {
  SystemClock clock;
  const auto deadline = Time::now() + kDarkPatience;
  for (;;) {
    auto lock = FileLock::acquire(path);
    if (lock || lock.error().code != ErrorCode::kBusy || Time::now() >= deadline) return lock;
    clock.sleep(10ms, {});
  }
}

}  // namespace

Guardian::Guardian(pid_t pid, FileDescriptor process, FileDescriptor hold)
    : pid_(pid),
      process_(std::move(process)),
      hold_(std::move(hold)),
      watcher_([this](const std::stop_token& stop) {
        if (wait_readable(process_.get(), Time::time_point::max(), stop)) death_.request_stop();
      }) {}

Result<std::unique_ptr<Guardian>> Guardian::start(const std::filesystem::path& program,
                                                  const std::filesystem::path& session,
                                                  std::stop_token stop) {
  auto hold = make_pipe();
  auto ready = make_pipe();
  if (!hold || !ready) return !hold ? hold.error() : ready.error();
  const auto pid =
      Spawn(hold->read.get(), ready->write.get()).run(program.string(), session.string());
  if (!pid) return pid.error();
  FileDescriptor process(open_process(*pid));
  if (!process) return system_error("pidfd_open");
  std::unique_ptr<Guardian> guardian(
      new Guardian(*pid, std::move(process), std::move(hold->write)));
  ready->write.reset();
  const auto readable = wait_readable(ready->read.get(), Time::now() + kReadyPatience, stop);
  if (!readable) return readable.error();
  char word = 0;
  if (::read(ready->read.get(), &word, 1) != 1 || word != kReady) {
    return unavailable("the guardian ended at once, and without one no light is switched on");
  }
  return guardian;
}

Guardian::~Guardian() {
  watcher_.request_stop();
  watcher_.join();
  hold_.reset();
  if (auto ended = wait_readable(process_.get(), Time::now() + kEndPatience, {}); !ended) {
    log::warning("guardian, process {}: {}", pid_, ended.error().message);
    return;
  }
  ::waitpid(pid_, nullptr, 0);
}

int guard(const std::filesystem::path& lock_path, const std::function<Result<void>()>& dark) {
  for (const int signal : {SIGINT, SIGTERM, SIGHUP, SIGPIPE}) std::signal(signal, SIG_IGN);
  const auto lock = acquire_patiently(lock_path);
  if (!lock) {
    log::error("guardian: {}", lock.error().message);
    return 1;
  }
  if (::write(1, &kReady, 1) != 1) log::warning("guardian: the job is gone already");
  ::close(1);
  block_until_end_of_input();
  SystemClock clock;
  const auto deadline = Time::now() + kDarkPatience;
  for (;;) {
    const auto done = dark();
    if (done) return 0;
    if (Time::now() >= deadline) {
      log::error("guardian: the light may still be on: {}", done.error().message);
      return 1;
    }
    clock.sleep(100ms, {});
  }
}

std::filesystem::path guardian_lock_path(std::string_view station) {
  std::filesystem::path path = station_lock_path(station);
  path += ".guardian";
  return path;
}

}  // namespace opaline::daemon
