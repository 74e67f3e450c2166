#pragma once

#include "daemon/router.h"
#include "daemon/station.h"

namespace opaline::daemon {

/// GET /v1/sessions/{id}/events?since=N: Server-Sent Events, from after number N (or after the
/// Last-Event-ID header) until the session is over.
void add_event_routes(Router& router, Station& station);

}  // namespace opaline::daemon
