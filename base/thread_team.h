#pragma once

#include <atomic>
#include <cstdint>
#include <thread>
#include <vector>

namespace opaline {

/// Threads that run one function together, again and again, with little to pay in between: they
/// spin for some microseconds before they sleep. One owner runs one function at a time.
class ThreadTeam {
 public:
  /// size counts the owner's thread, which works too; >= 1.
  explicit ThreadTeam(int size);
  ~ThreadTeam();
  ThreadTeam(const ThreadTeam&) = delete;
  ThreadTeam& operator=(const ThreadTeam&) = delete;

  int size() const { return static_cast<int>(threads_.size()) + 1; }

  /// Calls work(0) here and work(1) ... work(size() - 1) on the other threads; returns when all
  /// have returned.
  template <class Work>
  void run(const Work& work) {
    start([](const void* w, int thread) { (*static_cast<const Work*>(w))(thread); }, &work);
    work(0);
    finish();
  }

 private:
  using Call = void (*)(const void* work, int thread);
  void start(Call call, const void* work);
  void finish();
  void serve(int thread);

  Call call_ = nullptr;         // published by round_
  const void* work_ = nullptr;  // published by round_
  std::atomic<std::uint32_t> round_{0};
  std::atomic<int> busy_{0};
  std::atomic<bool> over_{false};
  std::vector<std::jthread> threads_;  // last: joins first
};

}  // namespace opaline
