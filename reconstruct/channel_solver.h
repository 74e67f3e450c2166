#pragma once

#include <functional>
#include <optional>
#include <stop_token>

#include "base/clock.h"
#include "reconstruct/channel_problem.h"
#include "reconstruct/checkpoint.h"
#include "reconstruct/diffusion/fluence_solver.h"

namespace opaline::reconstruct {

/// The minimisation of one channel, from the homogeneous fit or from where it stopped.
class ChannelSolver {
 public:
  struct Hooks {
    std::function<void(const ChannelReport&)> iterated;  ///< after every iteration
    std::function<Result<void>(const ChannelProgress&)>
        checkpoint;  ///< every options.checkpoint_every iterations
  };
  ChannelSolver(const ChannelProblem& problem,
                const InverseOptions& options,
                diffusion::FluenceSolver& solver,
                const Clock& clock,
                Hooks hooks);

  /// Runs to the end. Errors: kCancelled, the objective's, the checkpoint hook's.
  Result<ChannelProgress> run(std::optional<ChannelProgress> from, std::stop_token stop);

 private:
  Result<ChannelProgress> begin(std::stop_token stop);
  Result<StepOutcome> step(LbfgsState& state, const Bounds& box, std::stop_token stop);
  Result<void> iterate(ChannelProgress& progress, std::stop_token stop);
  void record(ChannelProgress& progress);
  std::optional<StopReason> reason_to_stop(const ChannelReport& report) const;
  Bounds bounds() const;

  const ChannelProblem& problem_;
  const InverseOptions& options_;
  diffusion::FluenceSolver& solver_;
  const Clock& clock_;
  Hooks hooks_;
  Objective objective_;
  long solves_before_ = 0;  // of the homogeneous fit and earlier runs of this channel
  double seconds_before_ = 0.0;
  std::chrono::nanoseconds start_{};
};

}  // namespace opaline::reconstruct
