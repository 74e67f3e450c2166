#pragma once

#include <functional>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "base/clock.h"
#include "base/dataset.h"
#include "reconstruct/channel_solver.h"
#include "reconstruct/checkpoint.h"
#include "reconstruct/diffusion/fluence_solver.h"
#include "reconstruct/grid_correction.h"
#include "reconstruct/illumination_subset.h"
#include "reconstruct/model_choice.h"

namespace opaline::reconstruct {

/// Finds the model that one channel of a dataset requires, by climbing models_to_try() with a warm start a rung:
///
///   - a rung is judged by the illuminations held out of the fit: the dataset's own, or else every fourth of the fit's,
///     which the chosen model gets back at the end;
///   - the sample is granted a structure (layers, cells) only if the simpler model leaves more than the noise and the
///     model's error explain (is_explained()) and the gain is significant (Gain::is_significant()); where layers gain
///     nothing, cells are tried all the same;
///   - finer cells only if that gain is significant, until the noise is reached (as ChannelReport::target_per_datum, of
///     the held-out data).
///
/// The held-out error of the rung that is taken is a little too good, being the best of at most four. Two numbers, or two
/// a layer, need few pictures: those rungs are fitted to four; coarse cells get six iterations. Whichever rung is the
/// answer is then fitted to the end, to all; where corrects_grid(), roughly first, and to the end with what the grid leaves
/// out at that answer taken off the pictures. A choice other than
/// Model::kAuto takes its rungs unasked; their held-out errors are found all the same. Where nothing can be held out
/// (fewer than three illuminations) kAuto is kHeterogeneous.
///
/// An engine, where there is one, is ChannelSolver's.
/// Threads: one call at a time; what it refers to outlives it. Errors: those of make_channel_problem, ChannelSolver, the
/// checkpoint hook; kCancelled.
class ModelLadder {
 public:
  struct Hooks {
    /// After every iteration of a rung, `done` of `rungs` behind it.
    std::function<void(const ChannelReport&, std::size_t done, std::size_t rungs)> iterated;
    /// Every options.checkpoint_every iterations and after each rung.
    std::function<Result<void>(const LadderProgress&)> checkpoint;
  };
  static Result<ModelLadder> create(const Dataset& dataset,
                                    int channel,
                                    const InverseOptions& options,
                                    diffusion::FluenceSolver& solver,
                                    const Clock& clock,
                                    Hooks hooks,
                                    InversionEngine* engine = nullptr);

  /// From the bottom, or from where it stopped. The answer's `best` holds cell values of (log sigma_s', log sigma_a).
  Result<LadderProgress> run(std::optional<LadderProgress> from, std::stop_token stop);

 private:
  ModelLadder(ChannelProblem all,
              ValidationSplit split,
              std::vector<ModelRung> rungs,
              InverseOptions options,
              diffusion::FluenceSolver& solver,
              const Clock& clock,
              Hooks hooks,
              InversionEngine* engine);
  Result<void> climb(std::stop_token stop);
  std::optional<std::string> reason_to_stop(std::size_t next) const;
  Result<void> fit(std::size_t rung, std::stop_token stop);
  Result<void> fit_homogeneous_rung(std::stop_token stop);
  Result<ChannelProgress> minimise(const ChannelProblem& problem,
                                   const ModelRung& rung,
                                   std::stop_token stop);
  Result<void> judge(std::size_t rung,
                     const std::vector<double>& cell_values,
                     const ChannelReport& report,
                     std::stop_token stop);
  void decide(ModelReport& report, const Misfit& held_out) const;
  Result<void> finish(std::stop_token stop);
  Result<void> fit_to_all(const ChannelProblem& problem, std::stop_token stop);
  Result<void> correct(std::stop_token stop);
  Result<Misfit> predict(const ChannelProblem& problem,
                         const std::vector<double>& cell_values,
                         std::stop_token stop);
  InverseOptions options_of(const ModelRung& rung) const;
  bool corrects() const { return corrects_grid(options_, all_.block); }
  void take(const std::vector<double>& cell_values, const ChannelReport& report);
  const ModelRung& best_rung() const;
  bool can_validate() const { return split_.held_out.data_count > 0; }

  ChannelProblem all_;  ///< the dataset's illuminations for the fit
  ValidationSplit split_;
  ChannelProblem few_;  ///< of the fit, for models of few parameters
  std::vector<ModelRung> rungs_;
  InverseOptions options_;
  diffusion::FluenceSolver& solver_;
  const Clock& clock_;
  Hooks hooks_;
  InversionEngine* engine_;  // null: none
  std::string asked_ = "the model was asked for";
  LadderProgress progress_;
  Misfit best_;  ///< of the held-out data, of the rung taken last
  std::chrono::nanoseconds rung_start_{};
};

}  // namespace opaline::reconstruct
