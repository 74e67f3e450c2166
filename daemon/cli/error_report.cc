#include "daemon/cli/error_report.h"

#include <fmt/format.h>

#include <cstdio>

#include "daemon/jobs/program.h"

namespace opaline::daemon {

int report(const Error& error) {
  fmt::print(stderr, "opaline: {}\n", error.message);
  return status_of(Result<void>(error));
}

int report(const Result<void>& done) {
  return done ? status_of(ProgramExit::kDone) : report(done.error());
}

}  // namespace opaline::daemon
