#pragma once

#include <string_view>

namespace opaline::daemon {

/// The release, as --version and the API say it: "0.1.0".
std::string_view version();

}  // namespace opaline::daemon
