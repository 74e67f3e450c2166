#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <stop_token>
#include <string>
#include <string_view>
#include <vector>

#include "reconstruct/host/host_solver.h"
#include "reconstruct/reduced_solver.h"

namespace opaline::reconstruct {

/// One setting to be measured, and the dial by which it differs from the settings as given.
struct TradeoffSetting {
  /// "given" | "regions and grid" | "tolerance" | "iterations" | "optimiser" | "back end" | "precision" |
  /// "grid correction" | "quality NAME", all of its dials at once
  std::string dial;
  Reduction reduction;
  InverseOptions options;
  diffusion::Precision precision = diffusion::Precision::kSingle;  ///< of the host back end
};

/// "4 x 4 regions, grid 1, 1e-05, lbfgs, host, single"
std::string describe(const TradeoffSetting& setting);

/// What to measure. Regions and grid are crossed, since the one is worth little without the other; each other dial is
/// turned alone, from the settings as given.
struct TradeoffPlan {
  std::vector<int> regions;        ///< n of n x n, most first
  std::vector<double> grid_steps;  ///< finest first
  std::vector<double> tolerances;
  std::vector<int> iterations;  ///< limits; the largest runs on to convergence
  std::vector<Method> methods;
  std::vector<BackEnd> back_ends;
  std::vector<diffusion::Precision> precisions;
  bool grid_correction =
      false;  ///< also with what the grid leaves out, if the settings are without
};

/// For a dataset of n x n regions: n, n/2, ... 1; the whole grid, half, a quarter of it; and all else there is. `quick`
/// leaves out what takes long: the finest grid beyond the settings as given, optimisers and back ends that are known to be slow.
TradeoffPlan plan_tradeoff(const Dataset& dataset, bool quick);

/// The settings of a plan, cheap ones first, so that an early end leaves most points; each once.
std::vector<TradeoffSetting> settings_of(const TradeoffPlan& plan, const InverseOptions& given);

/// What a setting came to.
struct TradeoffPoint {
  TradeoffSetting setting;
  Block grid;            ///< that was solved for
  double seconds = 0.0;  ///< of the whole reconstruction, its prediction of every picture included
  long solves = 0;       ///< for one right-hand side, all channels
  RelightingError held_out;
  std::optional<double> bssrdf_error;  ///< E, where the truth is known
  std::string failed;                  ///< why there is no figure; empty: there is
  bool on_front = false;               ///< nothing measured is both as fast and as accurate
};

/// What a setting is computed by.
struct TradeoffSolver {
  std::unique_ptr<diffusion::FluenceSolver> solver;
  InversionEngine* engine = nullptr;  ///< that lives in the solver; null: none
};

/// What a measurement works with; all of it outlives the call.
struct TradeoffContext {
  std::function<Result<TradeoffSolver>(const TradeoffSetting&)> make_solver;
  EventSink& events;
  const Clock& clock;
  /// E of a material, where the truth is known; may be empty.
  std::function<Result<double>(const Material&, std::stop_token)> bssrdf_error;
  double limit_seconds = 600.0;  ///< a setting that takes longer is given up
};

/// Measures one setting. One that cannot be used here (no such back end) or takes too long is an answer: `failed`.
/// Errors: kCancelled.
Result<TradeoffPoint> measure(const Dataset& dataset,
                              const TradeoffSetting& setting,
                              const TradeoffContext& context,
                              std::stop_token stop);

/// Marks the points that no other is at least as fast and as accurate as (Pareto), by relighting error.
void mark_front(std::vector<TradeoffPoint>& points);

/// tradeoff.csv: a header and one line a point, cells in quotes where they hold commas.
std::string tradeoff_csv(const std::vector<TradeoffPoint>& points);

}  // namespace opaline::reconstruct
