#include "daemon/routes/sessions.h"

#include <fmt/format.h>

#include <array>
#include <nlohmann/json.hpp>

#include "daemon/problem.h"

namespace opaline::daemon {
namespace {

HttpResponse answer(int status, const nlohmann::json& json) {
  HttpResponse response;
  response.status = status;
  response.body = json.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace) + "\n";
  return response;
}

HttpResponse answer(int status, const Result<SessionSnapshot>& snapshot) {
  return snapshot ? answer(status, to_json(*snapshot)) : problem(snapshot.error());
}

Result<NewSession> parse_wish(const HttpRequest& request) {
  const auto json = nlohmann::json::parse(request.body, nullptr, false);
  if (!json.is_object()) return invalid_argument("the body is not a JSON object");
  NewSession wish;
  wish.same_user = request.same_user;
  const std::array<std::pair<std::string_view, std::string*>, 4> known{
      {{"name", &wish.name},
       {"session", &wish.session_toml},
       {"rig", &wish.rig_toml},
       {"resolved", &wish.resolved_toml}}};
  for (const auto& [key, value] : json.items()) {
    const auto field = std::ranges::find(known, key, [](const auto& pair) { return pair.first; });
    if (field == known.end() || !value.is_string()) {
      return invalid_argument(fmt::format(
          "\"{}\": expected the strings session and rig (TOML), and perhaps resolved and name",
          key));
    }
    *field->second = value.get<std::string>();
  }
  if (wish.session_toml.empty()) return invalid_argument("\"session\" is missing: a TOML text");
  return wish;
}

HttpResponse create(Station& station, const HttpRequest& request) {
  const auto type = request.headers.find("content-type");
  if (type == request.headers.end() || !type->second.starts_with("application/json")) {
    return problem(415, "unsupported_media_type", "expected Content-Type: application/json");
  }
  const Result<NewSession> wish = parse_wish(request);
  if (!wish) return problem(wish.error());
  const Result<SessionSnapshot> snapshot = station.create_session(*wish);
  HttpResponse response = answer(202, snapshot);
  if (snapshot) response.headers.emplace_back("Location", "/v1/sessions/" + snapshot->id);
  return response;
}

HttpResponse list(Station& station) {
  const auto entries = station.list();
  if (!entries) return problem(entries.error());
  nlohmann::json sessions = nlohmann::json::array();
  for (const CatalogueEntry& entry : *entries) {
    sessions.push_back({{"id", entry.id},
                        {"name", entry.name},
                        {"state", entry.state},
                        {"created", entry.created},
                        {"directory", entry.directory}});
  }
  return answer(200, nlohmann::json{{"sessions", sessions}});
}

HttpResponse remove(Station& station, const std::string& id) {
  if (auto removed = station.remove(id); !removed) return problem(removed.error());
  HttpResponse response;
  response.status = 204;
  return response;
}

}  // namespace

void add_session_routes(Router& router, Station& station) {
  using Parameters = Router::Parameters;
  router.add("POST", "/v1/sessions", [&](const HttpRequest& request, const Parameters&) {
    return create(station, request);
  });
  router.add(
      "GET", "/v1/sessions", [&](const HttpRequest&, const Parameters&) { return list(station); });
  router.add("GET", "/v1/sessions/{id}", [&](const HttpRequest&, const Parameters& p) {
    return answer(200, station.session(p[0]));
  });
  router.add("DELETE", "/v1/sessions/{id}", [&](const HttpRequest&, const Parameters& p) {
    return remove(station, p[0]);
  });
  router.add("POST", "/v1/sessions/{id}/cancel", [&](const HttpRequest&, const Parameters& p) {
    return answer(202, station.cancel(p[0]));
  });
  router.add("POST", "/v1/sessions/{id}/resume", [&](const HttpRequest&, const Parameters& p) {
    return answer(202, station.resume(p[0]));
  });
}

}  // namespace opaline::daemon
