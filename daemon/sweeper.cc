#include "daemon/sweeper.h"

#include <system_error>
#include <utility>

#include "base/log.h"

namespace opaline::daemon {

void Sweeper::remove(std::filesystem::path directory) {
  const std::lock_guard lock(mutex_);
  waiting_.push_back(std::move(directory));
  wake_.notify_one();
}

void Sweeper::run(const std::stop_token& stop) {
  for (;;) {
    std::unique_lock lock(mutex_);
    wake_.wait(lock, stop, [this] { return !waiting_.empty(); });
    if (stop.stop_requested()) return;
    const std::filesystem::path directory = std::move(waiting_.front());
    waiting_.pop_front();
    lock.unlock();
    std::error_code error;
    std::filesystem::remove_all(directory, error);
    if (error) log::warning("cannot remove all of {}: {}", directory.string(), error.message());
  }
}

}  // namespace opaline::daemon
