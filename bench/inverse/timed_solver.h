#pragma once

#include <chrono>
#include <string>

#include "reconstruct/diffusion/fluence_solver.h"

namespace opaline::bench {

/// Another solver, and the time spent in it.
class TimedSolver final : public reconstruct::diffusion::FluenceSolver {
 public:
  explicit TimedSolver(reconstruct::diffusion::FluenceSolver& inner) : inner_(inner) {}

  Result<void> prepare(const reconstruct::diffusion::Medium& medium) override {
    const Timer timer(seconds_);
    return inner_.prepare(medium);
  }
  Result<reconstruct::diffusion::SolveSummary> solve(
      const reconstruct::diffusion::FieldBatch& b,
      reconstruct::diffusion::FieldBatch& phi,
      const reconstruct::diffusion::SolveOptions& options,
      std::stop_token stop) override {
    const Timer timer(seconds_);
    return inner_.solve(b, phi, options, std::move(stop));
  }
  std::string description() const override { return inner_.description(); }
  double seconds() const { return seconds_; }

 private:
  using Clock = std::chrono::steady_clock;
  class Timer {
   public:
    explicit Timer(double& sum) : sum_(sum) {}
    ~Timer() { sum_ += std::chrono::duration<double>(Clock::now() - start_).count(); }
    Timer(const Timer&) = delete;
    Timer& operator=(const Timer&) = delete;

   private:
    double& sum_;
    Clock::time_point start_ = Clock::now();
  };
  reconstruct::diffusion::FluenceSolver& inner_;
  double seconds_ = 0.0;
};

}  // namespace opaline::bench
