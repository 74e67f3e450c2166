#pragma once

#include "daemon/router.h"
#include "daemon/station.h"

namespace opaline::daemon {

/// GET /healthz and GET /v1/status.
void add_status_routes(Router& router, Station& station);

}  // namespace opaline::daemon
