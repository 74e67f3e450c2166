#include "reconstruct/tradeoff.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <thread>
#include <utility>

namespace opaline::reconstruct {
namespace {

constexpr int kPublishedIterations = 25;  // hundreds of times as dear as ours: a glimpse
constexpr int kConverge = 1000;

/// Asks for a stop after some time, unless it goes first.
class Deadline {
 public:
  explicit Deadline(double seconds)
      : thread_([this, seconds](const std::stop_token& over) {
          std::unique_lock lock(mutex_);
          const auto limit = std::chrono::duration<double>(std::min(seconds, 1e7));
          wake_.wait_for(lock, over, limit, [] { return false; });
          if (!over.stop_requested()) passed_.request_stop();
        }) {}
  std::stop_source& passed() { return passed_; }

 private:
  std::stop_source passed_;
  std::mutex mutex_;
  std::condition_variable_any wake_;
  std::jthread thread_;
};

int region_count(const Dataset& dataset) {
  const auto lights = std::ranges::count_if(dataset.illuminations,
                                            [](const Illumination& i) { return !i.held_out; });
  return std::max(1, static_cast<int>(std::lround(std::sqrt(static_cast<double>(lights)))));
}

double cost(const TradeoffSetting& s) {
  const double n = s.reduction.regions;
  const double cells = 1.0 / std::pow(s.reduction.grid_step, 3);
  const double method = s.options.method == Method::kAsPublished ? 100.0 : 1.0;
  const double back_end = s.options.back_end == BackEnd::kHost ? 1.0 : 30.0;
  return n * n * cells * method * back_end * (1.0 - std::log10(s.options.tolerance)) *
         (1 + s.options.max_iterations);
}

std::string quoted(const std::string& text) {
  std::string out = "\"";
  for (const char c : text) out += c == '"' ? std::string("\"\"") : std::string(1, c);
  return out + '"';
}

std::string csv_line(const TradeoffPoint& p) {
  const InverseOptions& o = p.setting.options;
  const std::string settings = fmt::format("{},{},{},{}x{}x{},{:g},{},{},{},{}",
                                           quoted(p.setting.dial),
                                           p.setting.reduction.regions,
                                           p.setting.reduction.grid_step,
                                           p.grid.nx,
                                           p.grid.ny,
                                           p.grid.nz,
                                           o.tolerance,
                                           o.max_iterations,
                                           to_string(o.method),
                                           to_string(o.back_end),
                                           to_string(p.setting.precision));
  if (!p.failed.empty()) return fmt::format("{},,,,,,,{}\n", settings, quoted(p.failed));
  return fmt::format("{},{:.4g},{},{:.5g},{:.5g},{},{},\n",
                     settings,
                     p.seconds,
                     p.solves,
                     p.held_out.error,
                     p.held_out.noise_floor,
                     p.bssrdf_error ? fmt::format("{:.5g}", *p.bssrdf_error) : "",
                     p.on_front ? 1 : 0);
}

void fill(const InverseResult& result, TradeoffPoint& point) {
  point.seconds = result.seconds;
  for (const ChannelReport& channel : result.channels) point.solves += channel.solves;
  point.held_out = result.held_out;
}

}  // namespace

std::string describe(const TradeoffSetting& s) {
  std::string text = fmt::format("{0} x {0} regions, grid {1:g}, {2:g}, {3}, {4}",
                                 s.reduction.regions,
                                 s.reduction.grid_step,
                                 s.options.tolerance,
                                 to_string(s.options.method),
                                 to_string(s.options.back_end));
  if (s.options.back_end == BackEnd::kHost) text += fmt::format(", {}", to_string(s.precision));
  if (s.dial == "iterations" || s.dial == "optimiser")
    text += fmt::format(", {} iterations", s.options.max_iterations);
  if (s.options.grid_correction) text += ", grid corrected";
  return text;
}

TradeoffPlan plan_tradeoff(const Dataset& dataset, bool quick) {
  TradeoffPlan plan;
  for (int n = region_count(dataset); n >= 1; n /= 2) plan.regions.push_back(n);
  if (quick) {
    plan.grid_steps = {2.0, 4.0};
    plan.tolerances = {1e-3};
    plan.iterations = {0};
    return plan;
  }
  plan.grid_steps = {1.0, 2.0, 4.0};
  plan.tolerances = {1e-2, 1e-3, 1e-4, 1e-6};
  plan.iterations = {0, 5, 20, kConverge};
  plan.methods = {Method::kLbfgs, Method::kGaussNewton, Method::kAsPublished};
  plan.back_ends = {BackEnd::kVulkan, BackEnd::kReference};
  plan.precisions = {diffusion::Precision::kHalf, diffusion::Precision::kDouble};
  plan.grid_correction = true;
  return plan;
}

std::vector<TradeoffSetting> settings_of(const TradeoffPlan& plan, const InverseOptions& given) {
  InverseOptions options = given;
  if (options.back_end == BackEnd::kAuto) options.back_end = BackEnd::kHost;
  const int n = plan.regions.empty() ? 0 : plan.regions.front();
  const TradeoffSetting base{"given", {1.0, n}, options};
  std::vector<TradeoffSetting> all{base};
  for (const int regions : plan.regions)
    for (const double step : plan.grid_steps)
      if (!(regions == n && step == 1.0))
        all.push_back({"regions and grid", {step, regions}, options});
  const auto turn = [&](const char* dial, auto change) {
    TradeoffSetting turned = base;
    turned.dial = dial;
    change(turned.options);
    all.push_back(std::move(turned));
  };
  for (const double tolerance : plan.tolerances)
    if (tolerance != options.tolerance)
      turn("tolerance", [&](InverseOptions& o) { o.tolerance = tolerance; });
  for (const int limit : plan.iterations)
    turn("iterations", [&](InverseOptions& o) {
      o.max_iterations = limit;
      if (limit < kConverge) return;
      o.discrepancy = 0.0;
      o.stalled /= 5.0;
    });
  for (const Method method : plan.methods)
    if (method != options.method)
      turn("optimiser", [&](InverseOptions& o) {
        o.method = method;
        if (method == Method::kAsPublished) o.max_iterations = kPublishedIterations;
      });
  for (const BackEnd back_end : plan.back_ends)
    if (back_end != options.back_end)
      turn("back end", [&](InverseOptions& o) { o.back_end = back_end; });
  for (const diffusion::Precision precision : plan.precisions) {
    if (precision == base.precision) continue;
    turn("precision", [](InverseOptions&) {});
    all.back().precision = precision;
  }
  if (plan.grid_correction && !options.grid_correction)
    turn("grid correction", [](InverseOptions& o) { o.grid_correction = true; });
  std::ranges::stable_sort(all, {}, cost);
  return all;
}

Result<TradeoffPoint> measure(const Dataset& dataset,
                              const TradeoffSetting& setting,
                              const TradeoffContext& context,
                              std::stop_token stop) {
  TradeoffPoint point{
      .setting = setting, .grid = {}, .held_out = {}, .bssrdf_error = {}, .failed = {}};
  const auto less = reduced(dataset, setting.reduction);
  if (!less) return less.error();
  point.grid = less->block;
  const auto solver = context.make_solver(setting);
  if (!solver) {
    point.failed = solver.error().message;
    return point;
  }
  Deadline deadline(context.limit_seconds);
  const std::stop_callback forward(stop, [&] { deadline.passed().request_stop(); });
  const auto result = reconstruct_reduced(
      dataset,
      setting.reduction,
      setting.options,
      {*solver->solver, context.events, context.clock, nullptr, {}, solver->engine},
      deadline.passed().get_token());
  if (stop.stop_requested()) return cancelled("stopped");
  if (!result) {
    point.failed = deadline.passed().stop_requested()
                       ? fmt::format("given up after {:g} s", context.limit_seconds)
                       : result.error().message;
    return point;
  }
  fill(*result, point);
  if (!context.bssrdf_error) return point;
  const auto e = context.bssrdf_error(result->material, stop);
  if (stop.stop_requested()) return cancelled("stopped");
  if (!e) return e.error();
  point.bssrdf_error = *e;
  return point;
}

void mark_front(std::vector<TradeoffPoint>& points) {
  for (TradeoffPoint& p : points) {
    const auto beats = [&](const TradeoffPoint& q) {
      return &q != &p && q.failed.empty() && q.seconds <= p.seconds &&
             q.held_out.error <= p.held_out.error &&
             (q.seconds < p.seconds || q.held_out.error < p.held_out.error);
    };
    p.on_front = p.failed.empty() && std::ranges::none_of(points, beats);
  }
}

std::string tradeoff_csv(const std::vector<TradeoffPoint>& points) {
  std::string text =
      "dial,regions,grid_step,cells,tolerance,max_iterations,optimiser,back_end,precision,seconds,"
      "solves,"
      "relighting_error,noise_floor,bssrdf_error,on_front,failed\n";
  for (const TradeoffPoint& p : points) text += csv_line(p);
  return text;
}

}  // namespace opaline::reconstruct
