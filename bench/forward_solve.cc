// How long do 16 illuminations of one medium take to a float64 residual of 1e-6, set-up included, and how does that
// compare with Eigen's conjugate gradients in the same run?
//
//   forward_solve [--case NAME] [--rounds N] [--no-eigen]
//
// prints one JSON object a figure (bench/figure.h).

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <chrono>
#include <optional>
#include <string_view>
#include <thread>
#include <vector>

#include "bench/figure.h"
#include "bench/forward/forward_case.h"
#include "reconstruct/host/host_solver.h"

namespace opaline::bench {
namespace {

using reconstruct::diffusion::FieldBatch;
using reconstruct::diffusion::FluenceSolver;
using reconstruct::diffusion::SolveSummary;

constexpr double kTolerance = 1e-6;

struct Arguments {
  std::string_view only;  ///< a case's name, or all of them
  int rounds = 5;
  bool eigen = true;
};

std::optional<Arguments> parse(int count, char** words) {
  Arguments arguments;
  for (int n = 1; n < count; ++n) {
    const std::string_view word = words[n];
    if (word == "--no-eigen") {
      arguments.eigen = false;
    } else if (word == "--case" && n + 1 < count) {
      arguments.only = words[++n];
    } else if (word == "--rounds" && n + 1 < count) {
      const std::string_view number = words[++n];
      std::from_chars(number.data(), number.data() + number.size(), arguments.rounds);
      if (arguments.rounds < 1) return std::nullopt;
    } else {
      return std::nullopt;
    }
  }
  return arguments;
}

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

/// The fields that the passes read and write on the finest level, in single precision, per iteration: restriction reads
/// r; prolongation reads r and writes z; direction and product read z, p, d and write p, d, q; the update reads r, q
/// and writes r. Coarser levels add a seventh to the first two. Replacing a residual moves x, b in double, d, p and r.
double bytes_counted(const ForwardCase& problem, int iterations) {
  const double number = sizeof(float) * static_cast<double>(problem.b.values.size());
  const double cycle = (1.0 + 2.0) * 8.0 / 7.0;
  constexpr double kReplacements = 3.0;
  return number *
         (iterations * (cycle + 6.0 + 3.0) + kReplacements * (2.0 + 2.0 + 2.0 + 2.0 + 2.0 + 1.0));
}

int run_case(const ForwardCase& problem, const Arguments& arguments, double triad) {
  const auto solver = reconstruct::host::make_host_solver({});
  std::vector<double> seconds;
  std::vector<double> setup;
  FieldBatch x(problem.b.cells, problem.b.count);
  int iterations = 0;
  for (int round = 0; round < arguments.rounds + 1; ++round) {
    std::fill(x.values.begin(), x.values.end(), 0.0);
    const auto start = std::chrono::steady_clock::now();
    if (!solver->prepare(problem.medium)) return 1;
    const double prepared = seconds_since(start);
    const Result<SolveSummary> solved = solver->solve(problem.b, x, {kTolerance, 100}, {});
    if (!solved) return 1;
    iterations = solved->iterations;
    if (round == 0) continue;  // the first one asks the system for memory
    seconds.push_back(seconds_since(start));
    setup.push_back(prepared);
  }
  const double total = median(seconds);
  print_figure("forward.seconds", problem.name, total, "s");
  print_figure("forward.setup_seconds", problem.name, median(setup), "s");
  print_figure("forward.iterations", problem.name, iterations, "1");
  print_figure("forward.relative_residual", problem.name, relative_residual(problem, x), "1");
  const double bytes = bytes_counted(problem, iterations);
  print_figure("forward.bytes", problem.name, bytes, "B");
  print_figure("forward.bandwidth_fraction", problem.name, bytes / total / triad, "1");
  if (!arguments.eigen) return 0;
  const int rounds = problem.b.cells > 1000000 ? 1 : std::min(3, arguments.rounds);
  const EigenRun eigen = run_eigen_cg(problem, kTolerance, rounds);
  print_figure("forward.eigen_cg_seconds", problem.name, eigen.seconds, "s");
  print_figure("forward.eigen_cg_relative_residual", problem.name, eigen.relative_residual, "1");
  print_figure("forward.ratio_vs_eigen_cg", problem.name, eigen.seconds / total, "1");
  return 0;
}

int run(const Arguments& arguments) {
  struct Size {
    const char* name;
    int nx, ny, nz;
  };
  const double triad = triad_bytes_per_second();
  print_figure("machine.triad_bandwidth", "all", triad, "B/s");
  for (const Size& size :
       {Size{"a64", 64, 64, 32}, Size{"wax1", 130, 53, 37}, Size{"marble", 256, 256, 20}}) {
    if (!arguments.only.empty() && arguments.only != size.name) continue;
    const ForwardCase problem = make_forward_case(size.name, size.nx, size.ny, size.nz);
    if (const int failed = run_case(problem, arguments, triad); failed != 0) return failed;
  }
  return 0;
}

}  // namespace
}  // namespace opaline::bench

int main(int argc, char** argv) {
  const auto arguments = opaline::bench::parse(argc, argv);
  if (!arguments) {
    fmt::print(stderr, "usage: forward_solve [--case a64|wax1|marble] [--rounds N] [--no-eigen]\n");
    return 2;
  }
  return opaline::bench::run(*arguments);
}
