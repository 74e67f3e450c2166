#pragma once

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstddef>
#include <stop_token>

#include "base/thread_team.h"

namespace opaline::render {

/// Adds the seconds of its life to a sum.
class SpentTime {
 public:
  explicit SpentTime(double& sum) : sum_(sum) {}
  ~SpentTime() {
    sum_ += std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
  }
  SpentTime(const SpentTime&) = delete;
  SpentTime& operator=(const SpentTime&) = delete;

 private:
  double& sum_;
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

/// Calls work(i) for 0 <= i < count on the team, until asked to stop.
template <class Work>
void for_each(std::size_t count, ThreadTeam& team, const std::stop_token& stop, const Work& work) {
  constexpr std::size_t kChunk = 256;
  std::atomic<std::size_t> next{0};
  team.run([&](int) {
    for (std::size_t first = next.fetch_add(kChunk); first < count && !stop.stop_requested();
         first = next.fetch_add(kChunk)) {
      for (std::size_t i = first; i < std::min(count, first + kChunk); ++i) work(i);
    }
  });
}

}  // namespace opaline::render
