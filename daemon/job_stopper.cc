#include "daemon/job_stopper.h"

#include <fmt/format.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <system_error>

#include "base/lock.h"
#include "base/log.h"
#include "base/unix_socket.h"
#include "daemon/jobs/control_client.h"

namespace opaline::daemon {
namespace {

constexpr std::chrono::milliseconds kControlDeadline{300};

Error process_error(std::string_view doing) {
  return unavailable(fmt::format("{}: {}", doing, std::generic_category().message(errno)));
}

// glibc 2.36 declares these for C only.
int pidfd_open(pid_t pid) { return static_cast<int>(::syscall(SYS_pidfd_open, pid, 0)); }
int pidfd_send_signal(int process, int number) {
  return static_cast<int>(::syscall(SYS_pidfd_send_signal, process, number, nullptr, 0));
}

// Who called listen() on the job's socket; also of a process that is stopped.
Result<pid_t> listener_at(const std::filesystem::path& socket) {
  const Result<FileDescriptor> connection = connect_unix(socket, kControlDeadline);
  if (!connection) return connection.error();
  struct ucred peer {};
  socklen_t size = sizeof peer;
  if (::getsockopt(connection->get(), SOL_SOCKET, SO_PEERCRED, &peer, &size) != 0) {
    return process_error("SO_PEERCRED");
  }
  return peer.pid;
}

Result<FileDescriptor> find_job(const SessionDirectory& session, std::optional<pid_t> child) {
  const Result<pid_t> pid = child ? *child : listener_at(session.control_socket());
  if (!pid) return pid.error();
  FileDescriptor process(pidfd_open(*pid));
  if (!process) return process_error("pidfd_open");
  if (child) return process;  // not waited for yet, so the number is still its own
  const Result<bool> held = FileLock::is_held(session.lock());
  if (!held) return held.error();
  if (!*held) return not_found("the job has ended");
  return process;
}

}  // namespace

void JobStopper::reset() {
  since_.reset();
  answered_ = false;
  signalled_ = 0;
  process_.reset();
}

void JobStopper::step(const SessionDirectory& session, std::optional<pid_t> child, bool asked) {
  const auto now = clock_->now();
  if (!since_) {
    since_ = now;
  } else if (now < next_) {
    return;
  }
  next_ = now + options_.period;
  if (!process_) {
    auto found = find_job(session, child);  // a job that only begins has no socket yet
    if (!found) log::debug("session {}: {}", session.id(), found.error().message);
    if (found) process_ = *std::move(found);
  }
  const auto waited = now - *since_;
  if (waited >= options_.kill_after) {
    signal(session, SIGKILL);
  } else if (waited >= options_.terminate_after) {
    signal(session, SIGTERM);
  } else if (!asked && !answered_) {
    ask(session);
  }
}

void JobStopper::ask(const SessionDirectory& session) {
  const auto answer = ask_job(session.control_socket(), {{"command", "cancel"}}, kControlDeadline);
  answered_ = answer.has_value();
  if (!answer) log::debug("session {}: {}", session.id(), answer.error().message);
}

void JobStopper::signal(const SessionDirectory& session, int number) {
  if (signalled_ == number || !process_) return;
  if (pidfd_send_signal(process_.get(), number) != 0) {
    log::warning("session {}: {}", session.id(), process_error("cannot signal its job").message);
    process_.reset();  // looked for again
    return;
  }
  signalled_ = number;
  log::warning("session {}: its job does not stop; sent signal {}", session.id(), number);
}

}  // namespace opaline::daemon
