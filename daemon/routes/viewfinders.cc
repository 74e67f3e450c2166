#include "daemon/routes/viewfinders.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "daemon/problem.h"
#include "daemon/routes/live_answers.h"
#include "daemon/routes/viewfinder_page.h"

namespace opaline::daemon {
namespace {

HttpResponse page_of(Viewfinders& viewfinders, const std::string& station) {
  if (const auto view = viewfinders.look(station); !view) return problem(view.error());
  HttpResponse response;
  response.content_type = "text/html; charset=utf-8";
  response.headers.emplace_back(
      "Content-Security-Policy",
      "default-src 'none'; img-src 'self'; connect-src 'self'; style-src 'unsafe-inline'; "
      "script-src 'unsafe-inline'");
  response.body = std::string(viewfinder_page());
  return response;
}

// The one string of a JSON body, under its name.
Result<std::string> string_in(const HttpRequest& request, const char* key) {
  const auto json = nlohmann::json::parse(request.body, nullptr, false);
  const bool good =
      json.is_object() && json.size() == 1 && json.contains(key) && json[key].is_string();
  if (good) return json[key].get<std::string>();
  return invalid_argument(fmt::format("expected a JSON object with the string \"{}\" alone", key));
}

HttpResponse start_one(Viewfinders& viewfinders, const HttpRequest& request) {
  if (!is_json(request)) return not_json();
  const Result<std::string> rig = string_in(request, "rig");
  if (!rig) return problem(rig.error());
  const auto view = viewfinders.start(*rig, request.same_user);
  HttpResponse response = view_answer(202, view);
  if (view)
    response.headers.emplace_back("Location",
                                  "/v1/viewfinders/" + view->value("station", std::string()));
  return response;
}

HttpResponse stop_one(Viewfinders& viewfinders, const std::string& station) {
  if (auto stopped = viewfinders.stop(station); !stopped) return problem(stopped.error());
  return view_answer(202, viewfinders.look(station));
}

HttpResponse answer_one(Viewfinders& viewfinders,
                        const HttpRequest& request,
                        const std::string& station) {
  if (!is_json(request)) return not_json();
  const Result<std::string> what = string_in(request, "answer");
  if (!what) return problem(what.error());
  if (auto said = viewfinders.answer(station, *what); !said) return problem(said.error());
  return view_answer(202, viewfinders.look(station));
}

}  // namespace

void add_viewfinder_routes(Router& router, Viewfinders& viewfinders) {
  using Parameters = Router::Parameters;
  router.add("POST", "/v1/viewfinders", [&](const HttpRequest& request, const Parameters&) {
    return start_one(viewfinders, request);
  });
  router.add("GET", "/v1/viewfinders/{station}", [&](const HttpRequest&, const Parameters& p) {
    return view_answer(200, viewfinders.look(p[0]));
  });
  router.add("DELETE", "/v1/viewfinders/{station}", [&](const HttpRequest&, const Parameters& p) {
    return stop_one(viewfinders, p[0]);
  });
  router.add(
      "GET", "/v1/viewfinders/{station}/picture", [&](const HttpRequest&, const Parameters& p) {
        return picture_of(viewfinders, p[0]);
      });
  router.add(
      "GET", "/v1/viewfinders/{station}/stream", [&](const HttpRequest&, const Parameters& p) {
        return picture_stream(viewfinders, p[0]);
      });
  router.add(
      "GET", "/v1/viewfinders/{station}/events", [&](const HttpRequest&, const Parameters& p) {
        return figure_stream(viewfinders, p[0]);
      });
  router.add("GET", "/v1/viewfinders/{station}/page", [&](const HttpRequest&, const Parameters& p) {
    return page_of(viewfinders, p[0]);
  });
  router.add("POST",
             "/v1/viewfinders/{station}/answer",
             [&](const HttpRequest& request, const Parameters& p) {
               return answer_one(viewfinders, request, p[0]);
             });
}

}  // namespace opaline::daemon
