#include "daemon/jobs/stop_signals.h"

#include <fcntl.h>
#include <poll.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <csignal>
#include <utility>

namespace opaline::daemon {
namespace {

constexpr std::array kWatched{SIGTERM, SIGINT, SIGPIPE};

std::atomic<int> signal_pipe = -1;
std::array<struct sigaction, kWatched.size()> old_actions;

// Async-signal-safe: one write to a pipe.
void note_signal(int signal) {
  const int saved = errno;
  const auto byte = static_cast<char>(signal);
  [[maybe_unused]] const auto ignored = ::write(signal_pipe.load(), &byte, 1);
  errno = saved;
}

void install_handlers() {
  for (std::size_t i = 0; i < kWatched.size(); ++i) {
    struct sigaction action {};
    action.sa_handler = kWatched[i] == SIGPIPE ? SIG_IGN : note_signal;
    action.sa_flags = SA_RESTART;
    ::sigaction(kWatched[i], &action, &old_actions[i]);
  }
}

void restore_handlers() {
  for (std::size_t i = 0; i < kWatched.size(); ++i) {
    ::sigaction(kWatched[i], &old_actions[i], nullptr);
  }
}

sigset_t stop_set() {
  sigset_t set;
  sigemptyset(&set);
  for (const int signal : {SIGTERM, SIGINT}) sigaddset(&set, signal);
  return set;
}

// Until the write end is closed. It waits in poll(): ThreadSanitizer runs no handler during read().
void pass_on(int fd, const std::function<void(int)>& on_signal) {
  for (;;) {
    pollfd ready{fd, POLLIN, 0};
    if (::poll(&ready, 1, -1) < 0 && errno != EINTR) return;
    if (ready.revents == 0) continue;
    char signal = 0;
    const ssize_t n = ::read(fd, &signal, 1);
    if (n == 1) on_signal(signal);
    if (n == 0 || (n < 0 && errno != EINTR)) return;
  }
}

}  // namespace

Result<std::unique_ptr<StopSignals>> StopSignals::watch(std::function<void(int)> on_signal) {
  std::array<int, 2> ends{};
  if (::pipe2(ends.data(), O_CLOEXEC) != 0) return unavailable("cannot create a pipe for signals");
  return std::unique_ptr<StopSignals>(
      new StopSignals(FileDescriptor(ends[0]), FileDescriptor(ends[1]), std::move(on_signal)));
}

StopSignals::StopSignals(FileDescriptor read_end,
                         FileDescriptor write_end,
                         std::function<void(int)> on_signal)
    : read_end_(std::move(read_end)), write_end_(std::move(write_end)) {
  signal_pipe = write_end_.get();
  install_handlers();
  const sigset_t stops = stop_set();
  ::pthread_sigmask(SIG_BLOCK, &stops, &old_mask_);
  thread_ = std::jthread([stops, fd = read_end_.get(), handler = std::move(on_signal)] {
    ::pthread_sigmask(SIG_UNBLOCK, &stops, nullptr);
    pass_on(fd, handler);
  });
}

StopSignals::~StopSignals() {
  restore_handlers();
  signal_pipe = -1;
  write_end_.reset();  // the thread reads the end of the file and returns
  thread_.join();
  ::pthread_sigmask(SIG_SETMASK, &old_mask_, nullptr);
}

}  // namespace opaline::daemon
