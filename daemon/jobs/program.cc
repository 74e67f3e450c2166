#include "daemon/jobs/program.h"

#include <cstdio>
#include <exception>

namespace opaline::daemon {

ProgramExit exit_of(const Result<void>& result) {
  if (result) return ProgramExit::kDone;
  switch (result.error().code) {
    case ErrorCode::kInvalidArgument:
    case ErrorCode::kNotFound:
      return ProgramExit::kBadInput;
    case ErrorCode::kCancelled:
      return ProgramExit::kCancelled;
    case ErrorCode::kBusy:
      return ProgramExit::kBusy;
    default:
      return ProgramExit::kFailed;
  }
}

int run_program(int argc, char** argv, int (*program)(int argc, char** argv)) {
  try {
    return program(argc, argv);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s: %s\n", argc > 0 ? argv[0] : "opaline", error.what());
    return status_of(ProgramExit::kFailed);
  }
}

}  // namespace opaline::daemon
