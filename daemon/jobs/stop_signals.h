#pragma once

#include <csignal>
#include <functional>
#include <memory>
#include <thread>

#include "base/file_descriptor.h"
#include "base/result.h"

namespace opaline::daemon {

/// While it lives, SIGTERM and SIGINT call `on_signal` with their number, on a thread of their own,
/// and SIGPIPE is ignored; afterwards the old handlers are back. The calling thread, and so all that
/// it starts meanwhile, blocks them: no wait of theirs is interrupted, and a signal has one thread to
/// go to. It ends on the thread it began on. One object a process at a time.
class StopSignals {
 public:
  static Result<std::unique_ptr<StopSignals>> watch(std::function<void(int)> on_signal);
  ~StopSignals();
  StopSignals(const StopSignals&) = delete;
  StopSignals& operator=(const StopSignals&) = delete;

 private:
  StopSignals(FileDescriptor read_end,
              FileDescriptor write_end,
              std::function<void(int)> on_signal);

  FileDescriptor read_end_;
  FileDescriptor write_end_;
  sigset_t old_mask_{};
  std::jthread thread_;
};

}  // namespace opaline::daemon
