#pragma once

#include <functional>
#include <string>

#include "base/result.h"

namespace CLI {  // NOLINT(readability-identifier-naming): the library's
class App;
}

namespace opaline::daemon {

/// How the program of a command (`opaline render` is opaline-render) goes once its options are declared: adds --version, parses,
/// does `work`, and writes its error to standard error. Returns the exit status: ProgramExit's, 2 for bad usage.
int run_command(CLI::App& app,
                const std::string& name,
                int argc,
                char** argv,
                const std::function<Result<void>()>& work);

}  // namespace opaline::daemon
