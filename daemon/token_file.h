#pragma once

#include <filesystem>
#include <string>

#include "base/result.h"

namespace opaline::daemon {

/// The token in the first line of a file: 16 characters or more. Errors: kInvalidArgument also for a
/// file that other users can read or change.
Result<std::string> read_token(const std::filesystem::path& file);

}  // namespace opaline::daemon
