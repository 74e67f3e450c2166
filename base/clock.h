#pragma once

#include <chrono>
#include <condition_variable>
#include <mutex>
#include <stop_token>
#include <string>

namespace opaline {

/// Monotonic time and waiting, so that no test sleeps.
class Clock {
 public:
  virtual ~Clock() = default;
  virtual std::chrono::nanoseconds now() const = 0;
  /// Waits; false when the stop request came first. Thread-safe.
  virtual bool sleep(std::chrono::nanoseconds duration, std::stop_token stop) = 0;
  /// How many of its seconds pass in a real one: what is told to people is in real ones.
  virtual double pace() const { return 1.0; }
};

/// CLOCK_MONOTONIC, run `factor` times as fast from this clock's making on: at 1000, a second passes in a millisecond.
class SystemClock : public Clock {
 public:
  explicit SystemClock(double factor = 1.0);
  std::chrono::nanoseconds now() const override;
  bool sleep(std::chrono::nanoseconds duration, std::stop_token stop) override;
  double pace() const override { return factor_; }

 private:
  double factor_;
  std::chrono::nanoseconds start_;  // real
};

/// Stands still until told, or until somebody sleeps: sleeping advances it at once.
class ManualClock : public Clock {
 public:
  std::chrono::nanoseconds now() const override;
  bool sleep(std::chrono::nanoseconds duration, std::stop_token stop) override;
  void advance(std::chrono::nanoseconds duration);

 private:
  mutable std::mutex mutex_;
  std::chrono::nanoseconds now_{};  // guarded by mutex_
};

/// Wall-clock UTC as "2026-01-31T12:34:56.789Z", for people.
std::string utc_now();

}  // namespace opaline
