#include "daemon/jobs/command_program.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>

#include "base/log.h"
#include "daemon/jobs/program.h"
#include "daemon/jobs/version.h"

namespace opaline::daemon {

int run_command(CLI::App& app,
                const std::string& name,
                int argc,
                char** argv,
                const std::function<Result<void>()>& work) {
  app.set_version_flag("--version", fmt::format("{} {}", name, version()));
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? 0 : status_of(ProgramExit::kBadInput);
  }
  log::set_level(log::Level::kWarning);  // what happens is shown by the program itself
  const auto done = work();
  if (!done) fmt::print(stderr, "{}: {}\n", name, done.error().message);
  return status_of(done);
}

}  // namespace opaline::daemon
