#pragma once

#include <string_view>

namespace opaline::daemon {

/// A page that shows a viewfinder's stream and figures as they come; it lies beside them: /v1/viewfinders/{station}/page.
std::string_view viewfinder_page();

}  // namespace opaline::daemon
