#pragma once

#include <deque>
#include <functional>
#include <optional>
#include <stop_token>
#include <utility>
#include <vector>

#include "base/clock.h"
#include "reconstruct/channel_problem.h"
#include "reconstruct/checkpoint.h"
#include "reconstruct/diffusion/fluence_solver.h"
#include "reconstruct/gauss_newton.h"
#include "reconstruct/minimiser.h"
#include "reconstruct/parametrization.h"

namespace opaline::reconstruct {

/// The minimisation of one channel over the parameters a of a Parametrization, J(P a) with the gradient P^T dJ/dp, from
/// the homogeneous fit, from a simpler model's answer, or from where it stopped. LbfgsState::x holds a.
///
/// Where every cell is a parameter and there is an engine that does what the options ask, it minimises; when its device
/// fails the objective on the solver goes on from the last checkpoint.
class ChannelSolver {
 public:
  struct Hooks {
    std::function<void(const ChannelReport&)> iterated;  ///< after every iteration
    std::function<Result<void>(const ChannelProgress&)>
        checkpoint;  ///< every options.checkpoint_every iterations
  };
  /// A simpler model's answer.
  struct WarmStart {
    HomogeneousFit homogeneous;
    std::vector<double> cell_values;  ///< (log sigma_s', log sigma_a), as Objective takes them
    long solves = 0;                  ///< that it took
    /// What is known of J's curvature by the cell values, oldest first; for a full parametrisation only.
    std::deque<CurvaturePair> pairs = {};
  };
  ChannelSolver(const ChannelProblem& problem,
                const InverseOptions& options,
                Parametrization parametrization,
                diffusion::FluenceSolver& solver,
                const Clock& clock,
                Hooks hooks,
                InversionEngine* engine = nullptr);

  /// What run() begins with instead of a homogeneous fit of its own.
  void start_from(WarmStart warm) { warm_ = std::move(warm); }
  /// This grid is only a step on the way: HomogeneousFit::rivals are tried by whoever asks for that.
  void leave_rivals() { try_rivals_ = false; }
  /// Runs to the end. Errors: kCancelled, the objective's, the checkpoint hook's.
  Result<ChannelProgress> run(std::optional<ChannelProgress> from, std::stop_token stop);

 private:
  Result<ChannelProgress> begin(std::stop_token stop);
  Result<WarmStart> start(std::stop_token stop) const;
  Result<Evaluation> evaluate(std::span<const double> x, std::stop_token stop);
  Result<StepOutcome> step(LbfgsState& state, const Bounds& box, std::stop_token stop);
  Result<HessianProduct> hessian(std::span<const double> x, const std::stop_token& stop);
  Result<void> iterate(ChannelProgress& progress, std::stop_token stop);
  Result<void> begin_on_engine(const ChannelProgress& progress);
  Result<void> read_back(ChannelProgress& progress);
  void record(ChannelProgress& progress);
  std::optional<StopReason> reason_to_stop(const ChannelReport& report) const;
  Bounds bounds() const;

  const ChannelProblem& problem_;
  const InverseOptions& options_;
  Parametrization parametrization_;
  diffusion::FluenceSolver& solver_;
  const Clock& clock_;
  Hooks hooks_;
  InversionEngine* engine_;
  std::unique_ptr<Minimiser> on_engine_;  // null: the objective below does the work
  ChannelProgress read_back_;             // where to go on from when the engine fails
  Objective objective_;
  std::optional<WarmStart> warm_;
  bool try_rivals_ = true;
  long solves_before_ = 0;  // of the homogeneous fit and earlier runs of this channel
  double seconds_before_ = 0.0;
  std::chrono::nanoseconds start_{};
};

}  // namespace opaline::reconstruct
