#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "base/result.h"

namespace opaline::daemon {

/// Becomes `programs`/NAME with these arguments, so that its terminal, Ctrl-C and exit status are ours: does not return,
/// unless it cannot. Errors: kUnavailable when the program is not there.
Error become(const std::filesystem::path& programs,
             const std::string& name,
             const std::vector<std::string>& arguments);

}  // namespace opaline::daemon
