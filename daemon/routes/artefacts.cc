#include "daemon/routes/artefacts.h"

#include <nlohmann/json.hpp>

#include "daemon/problem.h"

namespace opaline::daemon {
namespace {

HttpResponse list(Station& station, const std::string& id) {
  const Result<SessionDirectory> session = station.directory(id);
  if (!session) return problem(session.error());
  const auto artefacts = list_artefacts(*session);
  if (!artefacts) return problem(artefacts.error());
  nlohmann::json json = nlohmann::json::array();
  for (const Artefact& artefact : *artefacts) {
    json.push_back({{"name", artefact.name}, {"size", artefact.size}});
  }
  HttpResponse response;
  response.body = nlohmann::json{{"artefacts", json}}.dump(
                      -1, ' ', false, nlohmann::json::error_handler_t::replace) +
                  "\n";
  return response;
}

HttpResponse download(Station& station, const Router::Parameters& parameters) {
  const Result<SessionDirectory> session = station.directory(parameters[0]);
  if (!session) return problem(session.error());
  Result<OpenArtefact> artefact = open_artefact(*session, parameters[1]);
  if (!artefact) return problem(artefact.error());
  HttpResponse response;
  response.content_type = artefact->content_type;
  // A report holds what a configuration says: it may be looked at, and do nothing.
  response.headers.emplace_back(
      "Content-Security-Policy",
      "sandbox; default-src 'none'; img-src data:; style-src 'unsafe-inline'");
  response.file = *std::move(artefact);
  return response;
}

}  // namespace

void add_artefact_routes(Router& router, Station& station) {
  using Parameters = Router::Parameters;
  router.add("GET", "/v1/sessions/{id}/artefacts", [&](const HttpRequest&, const Parameters& p) {
    return list(station, p[0]);
  });
  router.add("GET",
             "/v1/sessions/{id}/artefacts/{name...}",
             [&](const HttpRequest&, const Parameters& p) { return download(station, p); });
}

}  // namespace opaline::daemon
