#pragma once

#include "daemon/router.h"
#include "daemon/viewfinders.h"

namespace opaline::daemon {

/// POST /v1/viewfinders; GET and DELETE /v1/viewfinders/{station}; and below that GET picture, stream, events and page, POST answer
/// (docs/api.md). The viewfinders outlive the router and every stream.
void add_viewfinder_routes(Router& router, Viewfinders& viewfinders);

}  // namespace opaline::daemon
