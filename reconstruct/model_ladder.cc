#include "reconstruct/model_ladder.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

#include "base/log.h"

namespace opaline::reconstruct {
namespace {

constexpr std::size_t kFew = 4;  // illuminations that a model of few parameters is found from
constexpr double kStalledBelow = 0.05;  // of a rung that is only a step on the way
// Where a fit ends that the grid's correction is found at: the correction hardly changes with the last of the misfit.
constexpr double kRoughDiscrepancy = 0.1;
constexpr double kRoughStalled = 0.01;
constexpr int kSketch = 6;  // iterations that show whether coarse cells gain anything

Model model_of(const InverseOptions& options) {
  if (options.max_iterations == 0) return Model::kHomogeneous;
  const bool published = options.method == Method::kAsPublished;
  return published && options.model == Model::kAuto ? Model::kHeterogeneous : options.model;
}

std::vector<double> constant(const Block& block, const HomogeneousFit& fit) {
  const std::size_t cells = block.cell_count();
  std::vector<double> values(cells, std::log(fit.reduced_scattering));
  values.resize(2 * cells, std::log(fit.absorption));
  return values;
}

double noise_of(const ChannelProblem& problem) {
  return problem.data_count > 0 ? problem.noise / static_cast<double>(problem.data_count) : 0.0;
}

bool has_few_parameters(const ModelRung& rung) { return rung.model != Model::kHeterogeneous; }

// The same story told on: iterations are numbered through, the shared point between two rungs stands once.
void append(std::vector<IterationRecord>& history, const std::vector<IterationRecord>& next) {
  if (history.empty()) {
    history = next;
    return;
  }
  const int before = history.back().iteration;
  for (IterationRecord record : next) {
    if (record.iteration == 0) continue;
    record.iteration += before;
    history.push_back(record);
  }
}

}  // namespace

Result<ModelLadder> ModelLadder::create(const Dataset& dataset,
                                        int channel,
                                        const InverseOptions& options,
                                        diffusion::FluenceSolver& solver,
                                        const Clock& clock,
                                        Hooks hooks,
                                        InversionEngine* engine) {
  auto all = make_channel_problem(dataset, channel, options, Selection::kFit);
  if (!all) return all.error();
  auto held_out = make_channel_problem(dataset, channel, options, Selection::kHeldOut);
  if (!held_out) return held_out.error();
  Model model = model_of(options);
  ValidationSplit split{*all, *std::move(held_out)};
  if (split.held_out.data_count == 0 && model == Model::kAuto) split = split_for_validation(*all);
  const bool unchecked = split.held_out.data_count == 0 && model == Model::kAuto;
  if (unchecked) model = Model::kHeterogeneous;
  auto rungs = models_to_try(model, dataset.block, dataset.lit_face);
  InverseOptions own = options;
  own.model = model;
  ModelLadder made(*std::move(all),
                   std::move(split),
                   std::move(rungs),
                   own,
                   solver,
                   clock,
                   std::move(hooks),
                   engine);
  if (unchecked) made.asked_ = "too few illuminations to hold one out and compare models by it";
  return made;
}

ModelLadder::ModelLadder(ChannelProblem all,
                         ValidationSplit split,
                         std::vector<ModelRung> rungs,
                         InverseOptions options,
                         diffusion::FluenceSolver& solver,
                         const Clock& clock,
                         Hooks hooks,
                         InversionEngine* engine)
    : all_(std::move(all)),
      split_(std::move(split)),
      few_(with_illuminations(split_.fit, few_illuminations(split_.fit, kFew))),
      rungs_(std::move(rungs)),
      options_(options),
      solver_(solver),
      clock_(clock),
      hooks_(std::move(hooks)),
      engine_(engine) {}

Result<LadderProgress> ModelLadder::run(std::optional<LadderProgress> from, std::stop_token stop) {
  progress_ = from ? *std::move(from) : LadderProgress{};
  progress_.report.held_out_noise = noise_of(split_.held_out);
  progress_.report.cross_validated =
      can_validate() && split_.fit.illuminations.size() < all_.illuminations.size();
  if (!progress_.finishing) {
    if (auto climbed = climb(stop); !climbed) return climbed.error();
    progress_.finishing = true;
    if (auto saved = hooks_.checkpoint(progress_); !saved) return saved.error();
  }
  if (auto finished = finish(stop); !finished) return finished.error();
  return std::move(progress_);
}

Result<void> ModelLadder::climb(std::stop_token stop) {
  if (!progress_.best.empty() && can_validate()) {
    auto again = predict(split_.held_out, progress_.best, stop);
    if (!again) return again.error();
    best_ = *std::move(again);
  }
  ChannelReport& report = progress_.report;
  for (std::size_t next = report.ladder.size(); next < rungs_.size(); ++next) {
    if (auto reason = reason_to_stop(next)) {
      report.model_reason = *std::move(reason);
      break;
    }
    if (auto fitted = fit(next, stop); !fitted)
      return fitted.error().in(rungs_[next].name + " model");
    if (auto saved = hooks_.checkpoint(progress_); !saved) return saved;
  }
  report.model = best_rung().name;
  if (!report.model_reason.empty()) return ok();
  if (options_.model != Model::kAuto) {
    report.model_reason = asked_;
  } else {
    report.model_reason =
        report.ladder.back().taken ? "there is no finer model" : "no finer model predicts better";
  }
  return ok();
}

std::optional<std::string> ModelLadder::reason_to_stop(std::size_t next) const {
  if (options_.model != Model::kAuto || next == 0) return std::nullopt;
  const bool has_cells = best_rung().model == Model::kHeterogeneous;
  if (!has_cells && is_explained(best_)) {
    return fmt::format(
        "the held-out pictures are explained to within noise and model error: χ² per datum {:.2f} "
        "± {:.2f}, 1 or less being expected",
        best_.per_datum(),
        best_.standard_error());
  }
  const double noise = progress_.report.held_out_noise;
  if (has_cells && best_.per_datum() <= noise + options_.discrepancy * (1.0 - noise))
    return "the held-out pictures are explained to within their measured noise";
  if (has_cells && !progress_.report.ladder.back().taken)
    return "finer cells do not predict better";
  return std::nullopt;
}

const ModelRung& ModelLadder::best_rung() const {
  std::size_t best = 0;
  for (std::size_t n = 0; n < progress_.report.ladder.size(); ++n) {
    if (progress_.report.ladder[n].taken) best = n;
  }
  return rungs_[best];
}

InverseOptions ModelLadder::options_of(const ModelRung& rung) const {
  InverseOptions own = options_;
  if (corrects() && !progress_.correcting) {
    own.discrepancy = std::max(own.discrepancy, kRoughDiscrepancy);
    own.stalled = std::max(own.stalled, kRoughStalled);
  }
  if (progress_.finishing || &rung == &rungs_.back()) return own;
  own.stalled = std::max(own.stalled, kStalledBelow);
  if (!has_few_parameters(rung)) own.max_iterations = std::min(own.max_iterations, kSketch);
  return own;
}

Result<ChannelProgress> ModelLadder::minimise(const ChannelProblem& problem,
                                              const ModelRung& rung,
                                              std::stop_token stop) {
  const InverseOptions own = options_of(rung);
  ChannelSolver solver(problem,
                       own,
                       rung.parametrization,
                       solver_,
                       clock_,
                       {[this](const ChannelReport& report) {
                          hooks_.iterated(report, progress_.report.ladder.size(), rungs_.size());
                        },
                        [this](const ChannelProgress& current) {
                          progress_.current = current;
                          auto saved = hooks_.checkpoint(progress_);
                          progress_.current.reset();
                          return saved;
                        }},
                       engine_);
  solver.start_from({progress_.report.homogeneous, progress_.best, progress_.report.solves});
  return solver.run(std::exchange(progress_.current, std::nullopt), std::move(stop));
}

Result<Misfit> ModelLadder::predict(const ChannelProblem& problem,
                                    const std::vector<double>& cell_values,
                                    std::stop_token stop) {
  Objective objective(problem, solver_, {options_.tolerance, 0.0});
  auto radiance = objective.predict(to_coefficients(cell_values), std::move(stop));
  if (!radiance) return radiance.error();
  return misfit(problem, *std::move(radiance));
}

Result<void> ModelLadder::fit(std::size_t rung, std::stop_token stop) {
  rung_start_ = clock_.now();
  if (rung == 0) return fit_homogeneous_rung(std::move(stop));
  const bool few = has_few_parameters(rungs_[rung]);
  const auto fitted = minimise(few ? few_ : split_.fit, rungs_[rung], stop);
  if (!fitted) return fitted.error();
  const auto cells = rungs_[rung].parametrization.expand(fitted->state.x);
  return judge(rung, cells, fitted->report, std::move(stop));
}

Result<void> ModelLadder::fit_homogeneous_rung(std::stop_token stop) {
  hooks_.iterated({}, 0, rungs_.size());
  InverseOptions sketch = options_;
  sketch.max_iterations = 1;  // all illuminations have their say in finish()
  auto homogeneous = fit_homogeneous(few_, sketch, solver_, stop);
  if (!homogeneous) return homogeneous.error();
  const auto cells = constant(all_.block, *homogeneous);
  const auto everywhere = predict(split_.fit, cells, stop);
  if (!everywhere) return everywhere.error();
  const auto count = static_cast<double>(split_.fit.data_count);
  homogeneous->chi_squared = everywhere->per_datum() * count;
  ChannelReport report;
  report.homogeneous = *homogeneous;
  report.data_count = split_.fit.data_count;
  report.noise_per_datum = noise_of(split_.fit);
  report.target_per_datum =
      report.noise_per_datum + options_.discrepancy * (1.0 - report.noise_per_datum);
  report.solves = homogeneous->solves;
  report.history.push_back(
      {0, 0.5 * homogeneous->chi_squared, everywhere->per_datum(), 0.0, report.solves});
  report.stop_reason = everywhere->per_datum() <= report.target_per_datum ? StopReason::kDiscrepancy
                                                                          : StopReason::kNoDescent;
  return judge(0, cells, report, std::move(stop));
}

Result<void> ModelLadder::judge(std::size_t rung,
                                const std::vector<double>& cell_values,
                                const ChannelReport& report,
                                std::stop_token stop) {
  ModelReport made;
  made.name = rungs_[rung].name;
  made.parameters = rungs_[rung].parametrization.size();
  made.fitted = report.history.back().chi_squared_per_datum;
  made.solves = report.solves - progress_.report.solves;
  Misfit held_out;
  if (can_validate()) {
    auto predicted = predict(split_.held_out, cell_values, std::move(stop));
    if (!predicted) return predicted.error();
    held_out = *std::move(predicted);
  }
  decide(made, held_out);
  made.seconds = std::chrono::duration<double>(clock_.now() - rung_start_).count();
  progress_.report.solves = report.solves;
  progress_.report.seconds += made.seconds;
  if (made.taken) {
    take(cell_values, report);
    best_ = std::move(held_out);
  }
  progress_.report.ladder.push_back(std::move(made));
  return ok();
}

void ModelLadder::decide(ModelReport& report, const Misfit& held_out) const {
  report.held_out = held_out.per_datum();
  report.standard_error = held_out.standard_error();
  report.taken = true;
  if (progress_.report.ladder.empty()) {
    report.why = "the simplest model";
    return;
  }
  const Gain gained = gain(split_.held_out, best_, held_out);
  report.gain = gained.per_datum;
  report.gain_error = gained.standard_error;
  if (options_.model != Model::kAuto) {
    report.why = "asked for";
    return;
  }
  report.taken = gained.is_significant();
  report.why = fmt::format("the held-out error {} by {:.3g} ± {:.2g}: {}",
                           gained.per_datum >= 0.0 ? "falls" : "rises",
                           std::abs(gained.per_datum),
                           gained.standard_error,
                           report.taken ? "taken" : "no more than chance explains, not taken");
}

void ModelLadder::take(const std::vector<double>& cell_values, const ChannelReport& report) {
  ChannelReport& own = progress_.report;
  progress_.best = cell_values;
  append(own.history, report.history);
  own.homogeneous = report.homogeneous;
  own.stop_reason = report.stop_reason;
  own.data_count = report.data_count;
  own.noise_per_datum = report.noise_per_datum;
  own.target_per_datum = report.target_per_datum;
}

Result<void> ModelLadder::fit_to_all(const ChannelProblem& problem, std::stop_token stop) {
  const ModelRung& rung = best_rung();
  ChannelReport& report = progress_.report;
  if (rung.model == Model::kHomogeneous) {
    auto fit = refine_homogeneous(problem, options_, report.homogeneous, solver_, std::move(stop));
    if (!fit) return fit.error();
    const auto count = static_cast<double>(problem.data_count);
    progress_.best = constant(problem.block, *fit);
    report.solves += fit->solves - report.homogeneous.solves;
    report.data_count = problem.data_count;
    report.noise_per_datum = noise_of(problem);
    report.history = {{0, 0.5 * fit->chi_squared, fit->chi_squared / count, 0.0, report.solves}};
    report.homogeneous = *fit;
    return ok();
  }
  const auto fitted = minimise(problem, rung, std::move(stop));
  if (!fitted) return fitted.error();
  report.solves = fitted->report.solves;
  take(rung.parametrization.expand(fitted->state.x), fitted->report);
  return ok();
}

Result<void> ModelLadder::correct(std::stop_token stop) {
  const auto correction =
      grid_correction(all_, to_coefficients(progress_.best), options_.tolerance, solver_, stop);
  if (!correction) return correction.error().in("correction of the grid");
  progress_.report.grid_correction = power(all_, *correction).relative();
  if (!progress_.current) progress_.report.solves += correction->solves;
  return fit_to_all(corrected(all_, *correction), std::move(stop));
}

Result<void> ModelLadder::finish(std::stop_token stop) {
  const auto start = clock_.now();
  const ModelRung& rung = best_rung();
  ChannelReport& report = progress_.report;
  const bool fitted_to_all =
      &rung == &rungs_.back() && !has_few_parameters(rung) && !report.cross_validated;
  if (!fitted_to_all && !progress_.correcting) {
    if (auto fitted = fit_to_all(all_, stop); !fitted) return fitted;
  }
  if (corrects()) {
    if (!progress_.correcting) {
      progress_.correcting = true;
      if (auto saved = hooks_.checkpoint(progress_); !saved) return saved;
    }
    if (auto fitted = correct(std::move(stop)); !fitted) return fitted;
  }
  report.seconds += std::chrono::duration<double>(clock_.now() - start).count();
  return ok();
}

}  // namespace opaline::reconstruct
