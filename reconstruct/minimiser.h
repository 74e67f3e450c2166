#pragma once

#include <memory>
#include <stop_token>

#include "base/result.h"
#include "reconstruct/channel_problem.h"
#include "reconstruct/lbfgs.h"

namespace opaline::reconstruct {

/// A minimisation of one channel's objective over p = (log sigma_s', log sigma_a) per cell that keeps its vectors
/// wherever it computes, and shows scalars between steps.
///
/// Threads: one call at a time.
/// Errors:  kCancelled; kUnavailable and kTimeout when the device fails, after which all it held is lost.
class Minimiser {
 public:
  virtual ~Minimiser() = default;
  virtual Result<StepOutcome> step(std::stop_token stop) = 0;
  /// Value, chi-squared and regularisation where it stands; no gradient.
  virtual Evaluation at() const = 0;
  /// Reads everything back: what the same minimisation goes on from.
  virtual Result<LbfgsState> state() = 0;
  /// Forgets the fields that solves start from, so that what follows depends on the state alone.
  virtual void start_afresh() = 0;
  /// Solves for one right-hand side done so far.
  virtual long solves() const = 0;
};

/// A back end that can do a whole minimisation by itself.
class InversionEngine {
 public:
  virtual ~InversionEngine() = default;
  /// Starts from a state of the whole parametrization. Null where the options ask for what this engine does not do (a
  /// method, a camera law): the objective on a FluenceSolver then does it. The problem outlives the minimiser; one
  /// minimiser an engine at a time.
  virtual Result<std::unique_ptr<Minimiser>> begin(const ChannelProblem& problem,
                                                   const InverseOptions& options,
                                                   const LbfgsState& from) = 0;
};

}  // namespace opaline::reconstruct
