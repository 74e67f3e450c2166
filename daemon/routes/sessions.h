#pragma once

#include "daemon/router.h"
#include "daemon/station.h"

namespace opaline::daemon {

/// POST and GET /v1/sessions; GET and DELETE /v1/sessions/{id}; POST .../cancel and .../resume.
void add_session_routes(Router& router, Station& station);

}  // namespace opaline::daemon
