#include "daemon/routes/viewfinders.h"

#include <fmt/format.h>

#include <chrono>
#include <nlohmann/json.hpp>

#include "daemon/problem.h"
#include "daemon/routes/viewfinder_page.h"

namespace opaline::daemon {
namespace {

using FileTime = std::filesystem::file_time_type;

constexpr const char* kBoundary = "opaline-view";
constexpr std::chrono::seconds kShownAgain{2};  // some browsers show a part when the next begins

std::string text_of_view(const nlohmann::json& json) {
  return json.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

HttpResponse view_answer(int status, const Result<nlohmann::json>& view) {
  if (!view) return problem(view.error());
  HttpResponse response;
  response.status = status;
  response.body = text_of_view(*view) + "\n";
  return response;
}

/// What a station sees, as it changes, until nobody shows anything there any more.
class ViewStream : public TextStream {
 public:
  ViewStream(Viewfinders& viewfinders, std::string station)
      : viewfinders_(viewfinders), station_(std::move(station)) {}

  std::string next() override {
    const FileTime changed = viewfinders_.changed(station_);
    const auto now = std::chrono::steady_clock::now();
    const bool fresh = changed != told_ && changed != FileTime();
    if (fresh || now - looked_ >= kShownAgain) {
      looked_ = now;
      view_ = viewfinders_.look(station_);
      const std::string state = view_ ? view_->value("state", "") : "failed";
      over_ = state == "over" || state == "failed";
      told_ = changed;
      return said(fresh);
    }
    return {};
  }
  bool is_over() const override { return over_; }

 protected:
  /// `fresh`: a picture has come since the last time.
  virtual std::string said(bool fresh) = 0;

  Viewfinders& viewfinders_;  // outlives every stream
  std::string station_;
  Result<nlohmann::json> view_ = nlohmann::json::object();
  bool over_ = false;

 private:
  FileTime told_;
  std::chrono::steady_clock::time_point looked_;
};

class FigureStream : public ViewStream {
 public:
  using ViewStream::ViewStream;

 private:
  std::string said(bool fresh) override {
    if (!view_)
      return fmt::format("event: error\ndata: {}\n\n",
                         text_of_view({{"message", view_.error().message}}));
    if (over_) return fmt::format("event: over\ndata: {}\n\n", text_of_view(*view_));
    if (!fresh) return {};
    return fmt::format(
        "id: {}\nevent: view\ndata: {}\n\n", view_->value("frame", 0), text_of_view(*view_));
  }
};

class PictureStream : public ViewStream {
 public:
  using ViewStream::ViewStream;

 private:
  std::string said(bool /*fresh*/) override {
    const auto png = viewfinders_.picture(station_);
    std::string text;
    if (png)
      text = fmt::format("--{}\r\nContent-Type: image/png\r\nContent-Length: {}\r\n\r\n{}\r\n",
                         kBoundary,
                         png->size(),
                         *png);
    if (over_) text += fmt::format("--{}--\r\n", kBoundary);
    return text;
  }
};

template <class Stream>
HttpResponse stream_of(Viewfinders& viewfinders,
                       const std::string& station,
                       const std::string& content_type) {
  if (const auto view = viewfinders.look(station); !view) return problem(view.error());
  HttpResponse response;
  response.content_type = content_type;
  response.stream = std::make_unique<Stream>(viewfinders, station);
  return response;
}

HttpResponse picture_of(Viewfinders& viewfinders, const std::string& station) {
  Result<std::string> png = viewfinders.picture(station);
  if (!png) return problem(png.error());
  HttpResponse response;
  response.content_type = "image/png";
  response.body = *std::move(png);
  return response;
}

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

bool is_json(const HttpRequest& request) {
  const auto type = request.headers.find("content-type");
  return type != request.headers.end() && type->second.starts_with("application/json");
}

HttpResponse not_json() {
  return problem(415, "unsupported_media_type", "expected Content-Type: application/json");
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
        return stream_of<PictureStream>(
            viewfinders, p[0], fmt::format("multipart/x-mixed-replace; boundary={}", kBoundary));
      });
  router.add(
      "GET", "/v1/viewfinders/{station}/events", [&](const HttpRequest&, const Parameters& p) {
        return stream_of<FigureStream>(viewfinders, p[0], "text/event-stream");
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
