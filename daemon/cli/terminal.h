#pragma once

#include "daemon/cli/progress_view.h"

namespace opaline::daemon {

/// Whether standard output is a terminal, and how wide.
ProgressView::Options terminal_options();

}  // namespace opaline::daemon
