#include "base/clock.h"

#include <fmt/chrono.h>
#include <fmt/format.h>

namespace opaline {
namespace {

using std::chrono::nanoseconds;

nanoseconds scaled(nanoseconds duration, double factor) {
  return nanoseconds(static_cast<nanoseconds::rep>(static_cast<double>(duration.count()) * factor));
}

}  // namespace

SystemClock::SystemClock(double factor)
    : factor_(factor), start_(std::chrono::steady_clock::now().time_since_epoch()) {}

// Only what has passed is scaled: hours of uptime times a large factor would overflow.
nanoseconds SystemClock::now() const {
  const nanoseconds real = std::chrono::steady_clock::now().time_since_epoch();
  return factor_ == 1.0 ? real : start_ + scaled(real - start_, factor_);
}

bool SystemClock::sleep(nanoseconds duration, std::stop_token stop) {
  std::mutex mutex;
  std::condition_variable_any wake;
  std::unique_lock lock(mutex);
  wake.wait_for(lock, stop, scaled(duration, 1.0 / factor_), [] { return false; });
  return !stop.stop_requested();
}

nanoseconds ManualClock::now() const {
  const std::lock_guard lock(mutex_);
  return now_;
}

bool ManualClock::sleep(nanoseconds duration, std::stop_token stop) {
  if (stop.stop_requested()) return false;
  advance(duration);
  return true;
}

void ManualClock::advance(nanoseconds duration) {
  const std::lock_guard lock(mutex_);
  now_ += duration;
}

std::string utc_now() {
  const auto now = std::chrono::system_clock::now();
  const auto ms =
      std::chrono::duration_cast<std::chrono::milliseconds>(now.time_since_epoch()) % 1000;
  const std::time_t seconds = std::chrono::system_clock::to_time_t(now);
  return fmt::format("{:%Y-%m-%dT%H:%M:%S}.{:03}Z", fmt::gmtime(seconds), ms.count());
}

}  // namespace opaline
