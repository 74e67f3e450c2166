// How long do 16 illuminations of one medium take to a float64 residual of 1e-6, set-up included, and how does that
// compare, in the same run, with hypre's multigrid, Eigen's conjugate gradients and the paper's hierarchical relaxation?
// Prints one JSON object a figure (bench/figure.h).

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "bench/figure.h"
#include "bench/forward/forward_case.h"
#include "reconstruct/host/host_solver.h"

namespace opaline::bench {
namespace {

using reconstruct::diffusion::FieldBatch;
using reconstruct::diffusion::SolveSummary;

constexpr double kTolerance = 1e-6;
constexpr int kPublished = 2;  // illuminations that relaxation as published is timed on

struct Arguments {
  std::vector<std::string> cases{"a64", "wax1", "marble"};
  int rounds = 5;
  reconstruct::diffusion::Precision precision = reconstruct::diffusion::Precision::kSingle;
  bool eigen = true;
  bool hypre = true;
  bool relaxation = true;
};

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

/// a = b + 3 c over 3 x 64 MiB on every core, bytes as the program sees them, best of five: what memory can give.
double triad_bytes_per_second() {
  constexpr std::size_t kCount = std::size_t{16} << 20U;
  std::vector<float> a(kCount, 0.0F);
  const std::vector<float> b(kCount, 1.0F);
  const std::vector<float> c(kCount, 2.0F);
  const std::size_t threads = std::max(1U, std::thread::hardware_concurrency());
  double best = 1e300;
  for (int round = 0; round < 5; ++round) {
    const auto start = std::chrono::steady_clock::now();
    std::vector<std::jthread> team;
    for (std::size_t t = 0; t < threads; ++t)
      team.emplace_back([&, t] {
        for (std::size_t n = kCount * t / threads; n < kCount * (t + 1) / threads; ++n)
          a[n] = b[n] + 3.0F * c[n];
      });
    team.clear();
    best = std::min(best, seconds_since(start));
  }
  return 3.0 * kCount * sizeof(float) / best;
}

/// The bytes that the algorithm has to move once it runs in passes that each see the finest level once, with a cache
/// that holds the planes at work and nothing between two passes; a store counts once, as where it is not read before.
/// Fields of 16 right-hand sides in the working precision ("number"), z in the precision that it is stored in; on the
/// finest level of black cells only, which are half of them.
///
///   an iteration   restriction reads r; prolongation reads r, writes z; the update reads z, s, d, r, writes s, d, r;
///                  8, 8 and 5 coefficients a cell; a seventh of whole fields and 17 coefficients for the coarser
///                  levels of the first two
///   the end        reads x, both d, b and writes x; 7 coefficients in float64
///   the start      looks at b and x, reads b, writes r; 6 coefficients in float64 and 1 rounded
///   the set-up     reads kappa and sigma_a, writes 7 coefficients in float64, reads them, writes 9; an eighth more
double bytes_counted(const ForwardCase& problem,
                     int iterations,
                     reconstruct::diffusion::Precision precision) {
  using reconstruct::diffusion::Precision;
  const double number = precision == Precision::kDouble ? 8.0 : 4.0;
  const double stored = precision == Precision::kHalf ? 2.0 : number;
  constexpr double kExact = sizeof(double);
  const auto values = static_cast<double>(problem.b.values.size());
  const auto cells = static_cast<double>(problem.b.cells);
  const double finest = values * (1.0 * number + 0.5 * stored) + cells * 16.0 * number;
  const double coarser = (values * (2.0 * number + stored) + cells * 17.0 * number) / 7.0;
  const double update = values * (3.0 * number + 0.5 * stored) + cells * 5.0 * number;
  const double end = values * (3.0 * kExact + 1.0 * number) + cells * 7.0 * kExact;
  const double start = values * (3.0 * kExact + 0.5 * number) + cells * (6.0 * kExact + number);
  const double setup = cells * (16.0 * kExact + 9.0 * number) * 8.0 / 7.0;
  return iterations * (finest + coarser + update) + end + start + setup;
}

struct Timed {
  double seconds = 0.0;
  double setup = 0.0;
  int iterations = 0;
  FieldBatch x;
};

/// Medians of the rounds.
Result<Timed> time_host(const ForwardCase& problem,
                        double tolerance,
                        int rounds,
                        reconstruct::diffusion::Precision precision) {
  const auto solver = reconstruct::host::make_host_solver({.precision = precision});
  std::vector<double> seconds;
  std::vector<double> setup;
  Timed timed{0.0, 0.0, 0, FieldBatch(problem.b.cells, problem.b.count)};
  for (int round = 0; round < rounds + 1; ++round) {
    std::fill(timed.x.values.begin(), timed.x.values.end(), 0.0);
    const auto start = std::chrono::steady_clock::now();
    if (auto prepared = solver->prepare(problem.medium); !prepared) return prepared.error();
    const double prepared = seconds_since(start);
    const Result<SolveSummary> solved = solver->solve(problem.b, timed.x, {tolerance, 100}, {});
    if (!solved) return solved.error();
    timed.iterations = solved->iterations;
    if (round == 0) continue;  // the first one asks the system for memory
    seconds.push_back(seconds_since(start));
    setup.push_back(prepared);
  }
  timed.seconds = median(seconds);
  timed.setup = median(setup);
  return timed;
}

struct Close {
  void operator()(FILE* pipe) const { ::pclose(pipe); }
};

/// hypre_pfmg's answer, one process a core; nothing where it was not built or does not run.
std::optional<nlohmann::json> run_hypre(const ForwardCase& problem, int rounds) {
  const auto program =
      std::filesystem::read_symlink("/proc/self/exe").parent_path() / "bench_hypre_pfmg";
  if (!std::filesystem::exists(program)) return std::nullopt;
  // hypre's own residual is that of its recurrence: a little stricter makes the true one 1e-6 as well.
  const std::string command = fmt::format(
      "OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1 OMP_NUM_THREADS=1 "
      "mpirun --oversubscribe -np {} '{}' {} {} {}",
      std::max(1U, std::thread::hardware_concurrency()),
      program.string(),
      problem.name,
      rounds,
      0.9 * kTolerance);
  const std::unique_ptr<FILE, Close> pipe(::popen(command.c_str(), "r"));
  if (!pipe) return std::nullopt;
  std::string text;
  for (int c = std::fgetc(pipe.get()); c != EOF; c = std::fgetc(pipe.get()))
    text.push_back(static_cast<char>(c));
  auto answer = nlohmann::json::parse(text, nullptr, /*allow_exceptions=*/false);
  if (answer.is_discarded() || !answer.contains("seconds")) return std::nullopt;
  return answer;
}

void compare_with_hypre(const ForwardCase& problem, const Timed& ours, int rounds) {
  const auto hypre = run_hypre(problem, rounds);
  if (!hypre) {
    fmt::print(stderr, "{}: no hypre (libhypre-dev, openmpi-bin), no comparison\n", problem.name);
    return;
  }
  const double seconds = hypre->value("seconds", 0.0);
  print_figure("forward.hypre_seconds", problem.name, seconds, "s");
  print_figure("forward.hypre_iterations", problem.name, hypre->value("iterations", 0), "1");
  print_figure(
      "forward.hypre_relative_residual", problem.name, hypre->value("relative_residual", 1.0), "1");
  print_figure("forward.ratio_vs_hypre", problem.name, seconds / ours.seconds, "x");
}

void compare_with_eigen(const ForwardCase& problem, const Timed& ours, int rounds) {
  const EigenRun eigen =
      run_eigen_cg(problem, kTolerance, problem.b.cells > 1000000 ? 1 : std::min(3, rounds));
  print_figure("forward.eigen_cg_seconds", problem.name, eigen.seconds, "s");
  print_figure("forward.eigen_cg_relative_residual", problem.name, eigen.relative_residual, "1");
  print_figure("forward.ratio_vs_eigen_cg", problem.name, eigen.seconds / ours.seconds, "x");
}

void print_relaxation(const ForwardCase& problem,
                      const char* how,
                      const RelaxationRun& relaxed,
                      double ours) {
  const std::string figure = fmt::format("forward.relaxation{}_", how);
  print_figure(figure + "front_face_error", problem.name, relaxed.error, "1");
  print_figure(figure + "sweeps", problem.name, relaxed.sweeps, "1");
  print_figure(figure + "seconds", problem.name, relaxed.seconds, "s");
  print_figure(
      fmt::format("forward.ratio_vs_relaxation{}", how), problem.name, relaxed.seconds / ours, "x");
}

/// Relaxation to the front-face error of our answer. As published it takes one illumination after the other, and is
/// timed on the first few; batched, it takes all of them in one sweep, which no paper does.
Result<void> compare_with_relaxation(const ForwardCase& problem, const Timed& ours) {
  const auto exact = time_host(problem, 1e-10, 1, reconstruct::diffusion::Precision::kSingle);
  if (!exact) return exact.error();
  const double error = front_face_error(problem, ours.x, exact->x);
  print_figure("forward.front_face_error", problem.name, error, "1");
  print_relaxation(
      problem, "", run_published_relaxation(problem, exact->x, error, kPublished), ours.seconds);
  print_relaxation(problem, "_batched", run_relaxation(problem, exact->x, error), ours.seconds);
  return ok();
}

Result<void> run_case(const ForwardCase& problem, const Arguments& arguments, double triad) {
  const auto ours = time_host(problem, kTolerance, arguments.rounds, arguments.precision);
  if (!ours) return ours.error();
  print_figure("forward.seconds", problem.name, ours->seconds, "s");
  print_figure("forward.nanoseconds_per_cell",
               problem.name,
               1e9 * ours->seconds / static_cast<double>(problem.b.values.size()),
               "ns");
  print_figure("forward.setup_seconds", problem.name, ours->setup, "s");
  print_figure("forward.iterations", problem.name, ours->iterations, "1");
  print_figure("forward.peak_mb", problem.name, peak_megabytes(), "MB");
  print_figure("forward.relative_residual", problem.name, relative_residual(problem, ours->x), "1");
  const double bytes = bytes_counted(problem, ours->iterations, arguments.precision);
  print_figure("forward.bytes", problem.name, bytes, "B");
  print_figure("forward.bandwidth_fraction", problem.name, bytes / ours->seconds / triad, "1");
  if (arguments.hypre) compare_with_hypre(problem, *ours, arguments.rounds);
  if (arguments.eigen) compare_with_eigen(problem, *ours, arguments.rounds);
  if (arguments.relaxation) return compare_with_relaxation(problem, *ours);
  return ok();
}

int run(const Arguments& arguments) {
  const double triad = triad_bytes_per_second();
  print_figure("machine.triad_bandwidth", "all", triad, "B/s");
  for (const std::string& name : arguments.cases) {
    const auto problem = make_forward_case(name);
    if (!problem) {
      fmt::print(stderr, "no case '{}'; there are a64, wax1, marble, cube64, cube256\n", name);
      return 2;
    }
    if (auto done = run_case(*problem, arguments, triad); !done) {
      fmt::print(stderr, "{}: {}\n", name, done.error().message);
      return 1;
    }
  }
  return 0;
}

}  // namespace
}  // namespace opaline::bench

int main(int argc, char** argv) try {
  CLI::App app(
      "Times 16 illuminations of one medium to a float64 residual of 1e-6 and compares with "
      "peers.\n"
      "Example: forward_solve --case cube64 --case cube256 --no-eigen --no-relaxation");
  opaline::bench::Arguments arguments;
  app.add_option("--case", arguments.cases, "a64, wax1, marble, cube64, cube256")->take_all();
  app.add_option("--rounds", arguments.rounds, "Of which the median is taken")
      ->check(CLI::Range(1, 1000));
  std::string precision = "single";
  app.add_option("--precision", precision, "Of the solver: half, single or double")
      ->check(CLI::IsMember({"half", "single", "double"}));
  app.add_flag("!--no-eigen", arguments.eigen, "Leave Eigen's conjugate gradients out");
  app.add_flag("!--no-hypre", arguments.hypre, "Leave hypre's multigrid out");
  app.add_flag("!--no-relaxation", arguments.relaxation, "Leave hierarchical relaxation out");
  CLI11_PARSE(app, argc, argv);
  using opaline::reconstruct::diffusion::Precision;
  for (const Precision one : {Precision::kHalf, Precision::kSingle, Precision::kDouble})
    if (to_string(one) == precision) arguments.precision = one;
  return opaline::bench::run(arguments);
} catch (const std::exception& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return 1;
}
