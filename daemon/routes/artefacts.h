#pragma once

#include "daemon/router.h"
#include "daemon/station.h"

namespace opaline::daemon {

/// GET /v1/sessions/{id}/artefacts and /v1/sessions/{id}/artefacts/{name...}.
void add_artefact_routes(Router& router, Station& station);

}  // namespace opaline::daemon
