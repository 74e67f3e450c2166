#pragma once

#include "daemon/live_objects.h"
#include "daemon/router.h"

namespace opaline::daemon {

/// /v1/sessions/{id}/object and what is below it (docs/api.md). The objects outlive the router.
void add_object_routes(Router& router, LiveObjects& objects);

}  // namespace opaline::daemon
