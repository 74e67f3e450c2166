// Kills the jobs of tiny sessions with SIGKILL at seeded moments, starts them again, and counts how many sessions
// complete and come out equal to an undisturbed one: captured files bit by bit, materials value by value (OpenVDB writes
// a random identifier into its files). Prints one JSON object a figure (bench/figure.h); ends with 1 where one did not.
//
//   faults [--captures N] [--reconstructions N] [--seed N]

#include <fmt/format.h>

#include <charconv>
#include <chrono>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/io/volume_io.h"
#include "bench/faults/fault_bed.h"
#include "bench/figure.h"

namespace opaline::bench {
namespace {

using faults::FaultBed;
using std::chrono::nanoseconds;

struct Arguments {
  int captures = 50;
  int reconstructions = 20;
  int seed = 1;
};

std::optional<Arguments> parse(int argc, char** argv) {
  Arguments arguments;
  for (int i = 1; i < argc; i += 2) {
    const std::string_view name = argv[i];
    int* value = name == "--captures"          ? &arguments.captures
                 : name == "--reconstructions" ? &arguments.reconstructions
                 : name == "--seed"            ? &arguments.seed
                                               : nullptr;
    if (value == nullptr || i + 1 == argc) return std::nullopt;
    const std::string_view text = argv[i + 1];
    const auto parsed = std::from_chars(text.data(), text.data() + text.size(), *value);
    if (parsed.ptr != text.data() + text.size() || *value < 0) return std::nullopt;
  }
  return arguments;
}

struct Tally {
  int sessions = 0;
  int kills = 0;      // that met the job alive
  int completed = 0;  // sessions that came to their end
  int equal = 0;  // to the undisturbed one: a capture's files bit by bit, a material value by value
};

/// How long a job takes undisturbed.
Result<nanoseconds> timed(const FaultBed& bed,
                          const std::string& program,
                          const std::filesystem::path& session) {
  const auto start = std::chrono::steady_clock::now();
  if (auto done = bed.complete(program, session); !done) return done.error();
  return std::chrono::steady_clock::now() - start;
}

/// Moments within the job's length, as many as are needed for `wanted` of them to meet it alive; three times as many at
/// most. `try_at` kills, completes and counts.
template <class TryAt>
Result<void> try_moments(nanoseconds length, int wanted, int seed, Tally& tally, TryAt try_at) {
  for (int round = 0; round < 3; ++round) {
    for (const nanoseconds at : faults::moments(length, wanted, seed + round)) {
      if (tally.kills == wanted) return ok();
      ++tally.sessions;
      if (auto tried = try_at(at); !tried) return tried;
    }
  }
  return ok();
}

Result<Tally> kill_captures(FaultBed& bed, const Arguments& arguments) {
  const auto reference = bed.new_session();
  if (!reference) return reference.error();
  if (auto warm = bed.complete("opaline-capture", *reference); !warm) return warm.error();
  const auto expected = faults::capture_results(*reference);
  if (!expected) return expected.error();
  const auto undisturbed = bed.new_session();  // the rig is up now
  if (!undisturbed) return undisturbed.error();
  const auto length = timed(bed, "opaline-capture", *undisturbed);
  if (!length) return length.error();
  Tally tally;
  const auto try_at = [&](nanoseconds at) -> Result<void> {
    const auto session = bed.new_session();
    if (!session) return session.error();
    const auto killed = bed.kill_and_complete("opaline-capture", *session, at);
    if (!killed) {
      fmt::print(stderr, "{}\n", killed.error().message);
      return ok();
    }
    tally.kills += *killed ? 1 : 0;
    ++tally.completed;
    const auto files = faults::capture_results(*session);
    tally.equal += files && *files == *expected ? 1 : 0;
    std::filesystem::remove_all(*session);
    return ok();
  };
  if (auto done = try_moments(*length, arguments.captures, arguments.seed, tally, try_at); !done)
    return done.error();
  return tally;
}

Result<Tally> kill_reconstructions(FaultBed& bed, const Arguments& arguments) {
  const auto reference = bed.new_session();
  if (!reference) return reference.error();
  if (auto captured = bed.complete("opaline-capture", *reference); !captured) {
    return captured.error();
  }
  const std::filesystem::path captured = bed.root() / "captured";
  std::filesystem::copy(*reference, captured, std::filesystem::copy_options::recursive);
  const auto length = timed(bed, "opaline-reconstruct", *reference);
  if (!length) return length.error();
  const auto expected = read_material(*reference / "material.vdb");
  if (!expected) return expected.error();
  Tally tally;
  const auto try_at = [&](nanoseconds at) -> Result<void> {
    const std::filesystem::path session = bed.root() / "reconstructed";
    std::filesystem::copy(captured, session, std::filesystem::copy_options::recursive);
    const auto killed = bed.kill_and_complete("opaline-reconstruct", session, at);
    if (killed) {
      tally.kills += *killed ? 1 : 0;
      ++tally.completed;
      const auto material = read_material(session / "material.vdb");
      tally.equal += material && *material == *expected ? 1 : 0;
    } else {
      fmt::print(stderr, "{}\n", killed.error().message);
    }
    std::filesystem::remove_all(session);
    return ok();
  };
  if (auto done = try_moments(*length, arguments.reconstructions, arguments.seed, tally, try_at);
      !done)
    return done.error();
  return tally;
}

/// Whether every session completed and came out equal, as often as was asked for.
bool report(const char* job, const char* equal, int wanted, const Tally& tally) {
  const std::string prefix = fmt::format("faults.{}_", job);
  print_figure(prefix + "sessions", "tiny", tally.sessions, "sessions");
  print_figure(prefix + "kills", "tiny", tally.kills, "kills");
  print_figure(prefix + "completed", "tiny", tally.completed, "sessions");
  print_figure(prefix + equal, "tiny", tally.equal, "sessions");
  return tally.kills >= wanted && tally.completed == tally.sessions &&
         tally.equal == tally.sessions;
}

int fail(const Error& error) {
  fmt::print(stderr, "faults: {}\n", error.message);
  return 1;
}

int run(const Arguments& arguments) {
  const auto programs = std::filesystem::read_symlink("/proc/self/exe").parent_path();
  const auto bed = FaultBed::create({programs});
  if (!bed) return fail(bed.error());
  bool good = true;
  if (arguments.captures > 0) {
    const auto tally = kill_captures(**bed, arguments);
    if (!tally) return fail(tally.error());
    good = report("capture", "bit_equal", arguments.captures, *tally);
  }
  if (arguments.reconstructions > 0) {
    const auto tally = kill_reconstructions(**bed, arguments);
    if (!tally) return fail(tally.error());
    good = report("reconstruct", "equal", arguments.reconstructions, *tally) && good;
  }
  return good ? 0 : 1;
}

}  // namespace
}  // namespace opaline::bench

int main(int argc, char** argv) {
  const auto arguments = opaline::bench::parse(argc, argv);
  if (!arguments) {
    fmt::print(stderr, "usage: faults [--captures N] [--reconstructions N] [--seed N]\n");
    return 2;
  }
  return opaline::bench::run(*arguments);
}
