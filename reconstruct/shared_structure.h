#pragma once

#include <array>
#include <functional>
#include <optional>
#include <span>
#include <stop_token>
#include <vector>

#include "base/clock.h"
#include "base/material.h"
#include "reconstruct/channel_problem.h"
#include "reconstruct/checkpoint.h"
#include "reconstruct/diffusion/fluence_solver.h"
#include "reconstruct/homogeneous_fit.h"
#include "reconstruct/objective.h"

namespace opaline::reconstruct {

/// What the three channels vary by, where they share one structure: a pattern v a coefficient, which is green's own, and
/// of the others what makes theirs of it,
///
///   log u_c = o_c + s_c (v - m),   u = sigma_s' and sigma_a;   o = m, s = 1 in green,
///
/// m the logarithm of green's homogeneous fit. One pigment in varying concentration has s = 1, one that saturates s < 1;
/// o is how much a channel scatters and absorbs throughout. So 2 cells + 8 parameters stand for 6 cells, and the noise
/// of three channels' pictures is shared by one pattern: coefficients closer to the truth under noise, pictures not
/// predicted better for it (docs/physics.md has figures).
///
/// Layout of x: v of log sigma_s', v of log sigma_a, then red's (o - o_0, s - 1) sqrt(cells) of each and blue's, o_0 the
/// channel's homogeneous fit: they act on all cells at once and would be sqrt(cells) times stiffer.
class SharedPattern {
 public:
  SharedPattern(const Block& block, const std::array<HomogeneousFit, kColorChannels>& homogeneous);

  std::size_t size() const { return 2 * cells_ + 8; }
  /// Every channel at its homogeneous fit.
  std::vector<double> start() const;
  /// (log sigma_s', log sigma_a) a cell of one channel, as Objective takes them.
  std::vector<double> expand(std::span<const double> x, std::size_t channel) const;
  /// Adds a channel's gradient by its cell values to the one by x: the transposed derivative of expand().
  void gather(std::span<const double> x,
              std::size_t channel,
              std::span<const double> cell_values,
              std::span<double> gradient) const;
  Bounds bounds(const InverseOptions& options) const;

 private:
  std::size_t place(std::size_t channel, std::size_t coefficient) const;  // of o; s follows
  std::size_t cells_;
  double weight_;  // of o and s in x: 1 / sqrt(cells), so that they are as stiff as a cell
  std::array<std::array<double, 2>, kColorChannels> logs_{};  // of the homogeneous fits
};

/// Minimises the sum of the three channels' objectives over a SharedPattern by L-BFGS, until the sum of their chi^2 is what
/// noise and the model's error (InverseOptions::discrepancy) make of it or nothing is gained any more. Regularised
/// as each channel by itself is.
///
/// Threads: one call at a time. Errors: the objectives', the checkpoint hook's; kCancelled.
class SharedSolver {
 public:
  struct Hooks {
    std::function<void(const ChannelReport&)> iterated;  ///< of green, after every iteration
    std::function<Result<void>(const SharedProgress&)> checkpoint;
  };
  SharedSolver(const std::array<ChannelProblem, kColorChannels>& problems,
               const InverseOptions& options,
               diffusion::FluenceSolver& solver,
               const Clock& clock,
               Hooks hooks);

  /// From the homogeneous fits, or from where it stopped.
  Result<SharedProgress> run(const std::array<HomogeneousFit, kColorChannels>& homogeneous,
                             std::optional<SharedProgress> from,
                             std::stop_token stop);

 private:
  Result<Evaluation> evaluate(const SharedPattern& pattern,
                              std::span<const double> x,
                              std::stop_token stop);
  Result<SharedProgress> begin(const SharedPattern& pattern,
                               const std::array<HomogeneousFit, kColorChannels>& homogeneous,
                               std::stop_token stop);
  void record(SharedProgress& progress);
  std::optional<StopReason> reason_to_stop(const SharedProgress& progress) const;

  const std::array<ChannelProblem, kColorChannels>& problems_;
  const InverseOptions& options_;
  const Clock& clock_;
  Hooks hooks_;
  std::vector<Objective> objectives_;
  struct Tried {  // a point of the step under way, told by the sum of the objectives there
    double value = 0.0;
    std::array<Evaluation, kColorChannels> channels;  // without gradients
  };
  std::vector<Tried> tried_;
  std::array<long, kColorChannels> solves_before_{};
  double seconds_before_ = 0.0;
  std::chrono::nanoseconds start_{};
};

}  // namespace opaline::reconstruct
