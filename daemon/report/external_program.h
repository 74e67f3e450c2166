#pragma once

#include <chrono>
#include <stop_token>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"

namespace opaline::daemon {

/// Runs a program of the machine's ($PATH) with `input` on its standard input, and answers its
/// standard output.
/// Errors: kUnavailable when there is no such program; kTimeout and kCancelled, when it has been
///         killed; kInternal with its first words on standard error when it fails.
Result<std::string> run_program(const std::vector<std::string>& command,
                                std::string_view input,
                                std::chrono::milliseconds deadline,
                                std::stop_token stop);

}  // namespace opaline::daemon
