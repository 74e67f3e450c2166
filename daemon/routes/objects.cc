#include "daemon/routes/objects.h"

#include "daemon/problem.h"
#include "daemon/routes/live_answers.h"

namespace opaline::daemon {
namespace {

HttpResponse start(LiveObjects& objects, const std::string& id) {
  const auto view = objects.start(id);
  HttpResponse response = view_answer(202, view);
  if (view) response.headers.emplace_back("Location", "/v1/sessions/" + id + "/object");
  return response;
}

HttpResponse stop(LiveObjects& objects, const std::string& id) {
  if (auto stopped = objects.stop(id); !stopped) return problem(stopped.error());
  return view_answer(202, objects.look(id));
}

HttpResponse wish(LiveObjects& objects, const HttpRequest& request, const std::string& id) {
  if (!is_json(request)) return not_json();
  const auto json = nlohmann::json::parse(request.body, nullptr, false);
  if (auto done = objects.wish(id, json); !done) return problem(done.error());
  return view_answer(202, objects.look(id));
}

}  // namespace

void add_object_routes(Router& router, LiveObjects& objects) {
  using Parameters = Router::Parameters;
  router.add("POST", "/v1/sessions/{id}/object", [&](const HttpRequest&, const Parameters& p) {
    return start(objects, p[0]);
  });
  router.add("GET", "/v1/sessions/{id}/object", [&](const HttpRequest&, const Parameters& p) {
    return view_answer(200, objects.look(p[0]));
  });
  router.add("DELETE", "/v1/sessions/{id}/object", [&](const HttpRequest&, const Parameters& p) {
    return stop(objects, p[0]);
  });
  router.add("POST",
             "/v1/sessions/{id}/object/wishes",
             [&](const HttpRequest& request, const Parameters& p) {
               return wish(objects, request, p[0]);
             });
  router.add("GET",
             "/v1/sessions/{id}/object/picture",
             [&](const HttpRequest&, const Parameters& p) { return picture_of(objects, p[0]); });
  router.add(
      "GET", "/v1/sessions/{id}/object/stream", [&](const HttpRequest&, const Parameters& p) {
        return picture_stream(objects, p[0]);
      });
  router.add("GET",
             "/v1/sessions/{id}/object/events",
             [&](const HttpRequest&, const Parameters& p) { return figure_stream(objects, p[0]); });
}

}  // namespace opaline::daemon
