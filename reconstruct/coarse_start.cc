#include "reconstruct/coarse_start.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "reconstruct/coarse_grid.h"

namespace opaline::reconstruct {
namespace {

using WarmStart = ChannelSolver::WarmStart;
using Transfer = std::vector<double> (*)(const Block&, const Block&, std::span<const double>);

constexpr int kMaxIterations = 30;  // on a coarse grid
constexpr double kStalled = 0.1;  // ten iterations that gain less than this are for the finer grid

/// Both halves of (log sigma_s', log sigma_a), from one grid to the other.
std::vector<double> transferred(Transfer transfer,
                                const Block& from,
                                const Block& to,
                                std::span<const double> values) {
  const std::size_t cells = from.cell_count();
  std::vector<double> out = transfer(from, to, values.first(cells));
  const std::vector<double> second = transfer(from, to, values.last(cells));
  out.insert(out.end(), second.begin(), second.end());
  return out;
}

InverseOptions coarse_options(InverseOptions options) {
  options.coarser_grids -= 1;
  options.discrepancy = 1.0;
  options.max_iterations = std::min(options.max_iterations, kMaxIterations);
  options.stalled = std::max(options.stalled, kStalled);
  return options;
}

std::deque<CurvaturePair> prolonged_pairs(const Block& coarse,
                                          const Block& fine,
                                          const std::deque<CurvaturePair>& pairs) {
  const double share =
      static_cast<double>(coarse.cell_count()) / static_cast<double>(fine.cell_count());
  std::deque<CurvaturePair> out;
  for (const CurvaturePair& pair : pairs) {
    CurvaturePair finer{transferred(prolonged, coarse, fine, pair.s),
                        transferred(prolonged, coarse, fine, pair.y)};
    for (double& y : finer.y) y *= share;
    double curvature = 0.0;
    for (std::size_t i = 0; i < finer.s.size(); ++i) curvature += finer.s[i] * finer.y[i];
    if (curvature > 0.0) out.push_back(std::move(finer));
  }
  return out;
}

/// The rivals of the homogeneous fit that `best` began with, tried too: the lowest end is `best` then. Whether one was.
template <typename Minimise>
Result<bool> outdo(ChannelProgress& best, const Block& block, const Minimise& minimise) {
  const std::size_t cells = block.cell_count();
  const HomogeneousFit began = best.report.homogeneous;
  long solves = best.report.solves;
  bool outdone = false;
  for (const StartCoefficients& rival : began.rivals) {
    WarmStart start{began, std::vector<double>(cells, std::log(rival.reduced_scattering))};
    start.cell_values.resize(2 * cells, std::log(rival.absorption));
    auto end = minimise(start);
    if (!end) return end.error();
    solves += end->report.solves;
    if (end->state.at.value >= best.state.at.value) continue;
    best = *std::move(end);
    outdone = true;
  }
  best.report.solves = solves;
  return outdone;
}

}  // namespace

Result<WarmStart> coarse_start(const ChannelProblem& problem,
                               const Block& coarse,
                               const InverseOptions& options,
                               const std::optional<WarmStart>& from,
                               bool try_rivals,
                               diffusion::FluenceSolver& solver,
                               const Clock& clock,
                               std::stop_token stop) {
  const Block& fine = problem.block;
  const ChannelProblem restricted_problem = coarsened(problem, coarse);
  const InverseOptions restricted_options = coarse_options(options);
  const auto minimised = [&](const std::optional<WarmStart>& start) -> Result<ChannelProgress> {
    ChannelSolver below(restricted_problem,
                        restricted_options,
                        Parametrization::full(coarse),
                        solver,
                        clock,
                        {[](const ChannelReport&) {}, [](const ChannelProgress&) { return ok(); }});
    below.leave_rivals();
    if (start) below.start_from(*start);
    auto end = below.run(std::nullopt, stop);
    if (!end)
      return end.error().in(fmt::format("{} x {} x {} cells", coarse.nx, coarse.ny, coarse.nz));
    return end;
  };
  std::optional<WarmStart> start;
  if (from)
    start = {from->homogeneous, transferred(restricted, fine, coarse, from->cell_values), 0};
  auto progress = minimised(start);
  if (!progress) return progress.error();
  const auto outdone = try_rivals ? outdo(*progress, coarse, minimised) : Result<bool>(false);
  if (!outdone) return outdone.error();
  const long solves = solves_on_finer(coarse, fine, progress->report.solves);
  if (from && !*outdone && progress->report.history.back().iteration == 0) {
    WarmStart warm = *from;
    warm.solves += solves;
    return warm;
  }
  WarmStart warm{progress->report.homogeneous,
                 transferred(prolonged, coarse, fine, progress->state.x),
                 solves + (from ? from->solves : 0)};
  if (options.method == Method::kLbfgs)
    warm.pairs = prolonged_pairs(coarse, fine, progress->state.pairs);
  return warm;
}

}  // namespace opaline::reconstruct
