#pragma once

#include <condition_variable>
#include <deque>
#include <filesystem>
#include <mutex>
#include <stop_token>
#include <thread>

namespace opaline::daemon {

/// Removes directories, which may take long, on a thread of its own. What is left when this object
/// goes stays where it is. Thread-safe.
class Sweeper {
 public:
  void remove(std::filesystem::path directory);

 private:
  void run(const std::stop_token& stop);

  std::mutex mutex_;
  std::condition_variable_any wake_;
  std::deque<std::filesystem::path> waiting_;                                // guarded by mutex_
  std::jthread thread_{[this](const std::stop_token& stop) { run(stop); }};  // last: joins first
};

}  // namespace opaline::daemon
