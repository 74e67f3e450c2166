#include "daemon/routes/status.h"

#include <nlohmann/json.hpp>
#include <string>

#include "daemon/jobs/version.h"
#include "daemon/problem.h"

namespace opaline::daemon {
namespace {

HttpResponse health() {
  HttpResponse response;
  response.body = nlohmann::json{{"status", "ok"}, {"version", version()}}.dump() + "\n";
  return response;
}

// Of the sessions that are not over, all that is known; of all, how many there are. Reads no log.
HttpResponse status(Station& station) {
  const auto counts = station.counts();
  if (!counts) return problem(counts.error());
  nlohmann::json active = nlohmann::json::array();
  for (const SessionSnapshot& snapshot : station.active()) active.push_back(to_json(snapshot));
  HttpResponse response;
  response.body = nlohmann::json{{"version", version()},
                                 {"sessions_directory", station.root().string()},
                                 {"counts", *counts},
                                 {"active", active}}
                      .dump(-1, ' ', false, nlohmann::json::error_handler_t::replace) +
                  "\n";
  return response;
}

}  // namespace

void add_status_routes(Router& router, Station& station) {
  router.add(
      "GET", "/healthz", [](const HttpRequest&, const Router::Parameters&) { return health(); });
  router.add("GET", "/v1/status", [&](const HttpRequest&, const Router::Parameters&) {
    return status(station);
  });
}

}  // namespace opaline::daemon
