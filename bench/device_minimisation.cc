// How long a step of the minimisation takes on a Vulkan device, beside the same step on the host.

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <array>
#include <chrono>
#include <cmath>
#include <exception>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "bench/figure.h"
#include "reconstruct/diffusion/camera_equation.h"
#include "reconstruct/host/host_solver.h"
#include "reconstruct/objective.h"
#include "reconstruct/vulkan/vulkan_solver.h"

namespace opaline::bench {
namespace {

using namespace reconstruct;  // NOLINT(google-build-using-namespace)

constexpr int kRegions = 4;  // n x n lit patches

struct Case {
  std::string name;
  Block block;
};

std::optional<Case> case_of(const std::string& name) {
  std::array<int, 3> n{};
  if (std::sscanf(name.c_str(), "%dx%dx%d", &n[0], &n[1], &n[2]) != 3) return std::nullopt;
  if (n[0] < 1 || n[1] < 1 || n[2] < 1) return std::nullopt;
  return Case{name, {n[0], n[1], n[2], 0.5, 0.5, 0.5}};
}

/// Smooth veins: sigma_s' 1 to 3, sigma_a 0.005 to 0.015 per mm.
ChannelCoefficients veined(const Block& block) {
  ChannelCoefficients c;
  for (int k = 0; k < block.nz; ++k)
    for (int j = 0; j < block.ny; ++j)
      for (int i = 0; i < block.nx; ++i) {
        const double wave = std::sin(0.4 * i) * std::cos(0.3 * j + 0.2 * k);
        c.reduced_scattering.push_back(2.0 + wave);
        c.absorption.push_back(0.01 - 0.005 * wave);
      }
  return c;
}

std::vector<double> patch(const Block& block, int region) {
  std::vector<double> q;
  for (int j = 0; j < block.ny; ++j)
    for (int i = 0; i < block.nx; ++i) {
      const bool lit = i * kRegions / block.nx == region % kRegions &&
                       j * kRegions / block.ny == region / kRegions;
      q.push_back(lit ? 1.0 : 0.0);
    }
  return q;
}

/// Back-lit pictures of the veins with 1 % of noise. They are of the same discretisation: what is measured is time.
Result<ChannelProblem> make_problem(const Block& block, diffusion::FluenceSolver& solver) {
  const auto boundary = diffusion::make_boundary(diffusion::BoundaryModel::kTwoMoment, 1.3);
  if (!boundary) return boundary.error();
  ChannelProblem problem{.block = block,
                         .lit_face = Face::kZMin,
                         .seen_face = Face::kZMax,
                         .boundary = *boundary,
                         .source = {},
                         .camera = {},
                         .rays = {},
                         .illuminations = {},
                         .data_count = 1};
  problem.camera.assign(block.face_cell_count(Face::kZMax),
                        diffusion::camera_equation(1.3, *boundary, 1.0));
  for (int m = 0; m < kRegions * kRegions; ++m)
    problem.illuminations.push_back({patch(block, m), {}, {}, 0.0});
  Objective objective(problem, solver, {.tolerance = 1e-8});
  const auto seen = objective.predict(veined(block), {});
  if (!seen) return seen.error();
  std::mt19937 random(1);
  std::normal_distribution<double> noise(0.0, 0.01);
  for (std::size_t m = 0; m < seen->size(); ++m)
    for (const double radiance : (*seen)[m]) {
      problem.illuminations[m].radiance.push_back(radiance * (1.0 + noise(random)));
      problem.illuminations[m].weight.push_back(std::pow(0.01 * radiance + 1e-7, -2));
    }
  return problem;
}

class HostMinimiser final : public Minimiser {
 public:
  HostMinimiser(const ChannelProblem& problem,
                diffusion::FluenceSolver& solver,
                const InverseOptions& options,
                LbfgsState from)
      : objective_(problem,
                   solver,
                   {.tolerance = options.tolerance, .regularization = options.regularization}),
        state_(std::move(from)) {
    const std::size_t cells = problem.block.cell_count();
    box_.lower.assign(cells, std::log(options.reduced_scattering.lowest));
    box_.lower.resize(2 * cells, std::log(options.absorption.lowest));
    box_.upper.assign(cells, std::log(options.reduced_scattering.highest));
    box_.upper.resize(2 * cells, std::log(options.absorption.highest));
  }
  Result<StepOutcome> step(std::stop_token stop) override {
    const ObjectiveFunction evaluate = [this](std::span<const double> x, std::stop_token token) {
      return objective_.evaluate(x, std::move(token));
    };
    return lbfgs_step(state_, box_, {}, evaluate, std::move(stop));
  }
  Evaluation at() const override { return state_.at; }
  Result<LbfgsState> state() override { return state_; }
  void start_afresh() override { objective_.start_afresh(); }
  long solves() const override { return objective_.solves(); }

 private:
  Objective objective_;
  LbfgsState state_;
  Bounds box_;
};

struct Run {
  double seconds_per_step = 0.0;  // median
  double solves = 0.0;
  double objective = 0.0;
};

Result<Run> run_steps(Minimiser& minimiser, int steps) {
  std::vector<double> seconds;
  for (int i = 0; i < steps; ++i) {
    const auto start = std::chrono::steady_clock::now();
    const auto outcome = minimiser.step({});
    if (!outcome) return outcome.error();
    seconds.push_back(
        std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
  }
  return Run{median(seconds), static_cast<double>(minimiser.solves()), minimiser.at().value};
}

void print(const std::string& which, const Run& run) {
  print_figure("device.seconds_per_step", which, run.seconds_per_step, "s");
  print_figure("device.solves", which, run.solves, "1");
  print_figure("device.objective", which, run.objective, "1");
}

Result<void> run(const Case& which, int steps, const InverseOptions& options) {
  const auto host = host::make_host_solver({.threads = options.threads});
  const auto problem = make_problem(which.block, *host);
  if (!problem) return problem.error();
  auto device = vulkan::make_vulkan_back_end({});
  if (!device) return device.error();
  LbfgsState start;
  const std::size_t cells = which.block.cell_count();
  start.x.assign(cells, std::log(2.0));
  start.x.resize(2 * cells, std::log(0.01));
  Objective objective(*problem, *host, {options.tolerance, options.regularization});
  auto at = objective.evaluate(start.x, {});
  if (!at) return at.error();
  start.at = *std::move(at);
  const auto on_device = device->engine->begin(*problem, options, start);
  if (!on_device) return on_device.error();
  HostMinimiser on_host(*problem, *host, options, start);
  const auto host_run = run_steps(on_host, steps);
  if (!host_run) return host_run.error();
  const auto device_run = run_steps(**on_device, steps);
  if (!device_run) return device_run.error();
  print(fmt::format("{}, {}", which.name, host->description()), *host_run);
  print(fmt::format("{}, {}", which.name, device->solver->description()), *device_run);
  print_figure("device.ratio_vs_host",
               fmt::format("{}, {}", which.name, device->solver->description()),
               host_run->seconds_per_step / device_run->seconds_per_step,
               "1");
  print_figure("device.peak_mb", which.name, peak_megabytes(), "MB");
  if (!vulkan::real_gpu_available())
    fmt::print(stderr, "{}: no GPU here; the device is a software one\n", which.name);
  return ok();
}

}  // namespace
}  // namespace opaline::bench

int main(int argc, char** argv) try {
  using namespace opaline;  // NOLINT(google-build-using-namespace)
  CLI::App app(
      "Times L-BFGS steps on a Vulkan device beside the host's: 16 back-lit pictures, 1 % noise.\n"
      "On a machine without a GPU Mesa's software device answers, which computes on the processor "
      "and\nis slower than the host back end.\n"
      "Example: device_minimisation --case 130x53x37 --steps 5");
  std::vector<std::string> names{"48x48x12", "130x53x37"};
  int steps = 5;
  reconstruct::InverseOptions options;
  app.add_option("--case", names, "NXxNYxNZ cells of 0.5 mm")->take_all();
  app.add_option("--steps", steps, "Of each minimisation")->check(CLI::Range(1, 1000));
  app.add_option("--tolerance", options.tolerance, "Of the solves");
  app.add_option("--threads", options.threads, "Of the host; 0: one a core");
  CLI11_PARSE(app, argc, argv);
  for (const std::string& name : names) {
    const auto which = bench::case_of(name);
    const auto done = which ? bench::run(*which, steps, options)
                            : Result<void>(invalid_argument("expected NXxNYxNZ, each >= 1"));
    if (done) continue;
    fmt::print(stderr, "{}: {}\n", name, done.error().message);
    return 1;
  }
  return 0;
} catch (const std::exception& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return 1;
}
