#pragma once

#include <chrono>

namespace opaline::bench {

double cpu_seconds();  ///< of all of the program's threads, so far

/// Time since it was made.
class Stopwatch {
 public:
  double cpu() const { return cpu_seconds() - cpu_start_; }  ///< of all threads
  double seconds() const {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
  }

 private:
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
  double cpu_start_ = cpu_seconds();
};

}  // namespace opaline::bench
