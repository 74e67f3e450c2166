#pragma once

#include <cstdint>

#include "base/result.h"

namespace opaline::daemon {

/// How any of our processes ends, for whoever started it.
enum class ProgramExit : std::uint8_t {
  kDone = 0,
  kFailed = 1,
  kBadInput = 2,  ///< bad usage, kInvalidArgument, kNotFound
  kCancelled = 3,
  kBusy = 4,
};
ProgramExit exit_of(const Result<void>& result);
constexpr int status_of(ProgramExit exit) { return static_cast<int>(exit); }
inline int status_of(const Result<void>& result) { return status_of(exit_of(result)); }

/// What main() of every program returns: what `program` does, or kFailed with the message of what a library threw.
int run_program(int argc, char** argv, int (*program)(int argc, char** argv));

}  // namespace opaline::daemon
