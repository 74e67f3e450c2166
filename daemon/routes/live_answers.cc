#include "daemon/routes/live_answers.h"

#include <fmt/format.h>

#include <chrono>
#include <memory>
#include <utility>

#include "daemon/problem.h"

namespace opaline::daemon {
namespace {

using FileTime = std::filesystem::file_time_type;

constexpr const char* kBoundary = "opaline-view";
constexpr std::chrono::seconds kShownAgain{2};  // some browsers show a part when the next begins

std::string text_of_view(const nlohmann::json& json) {
  return json.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

/// What is shown, as it changes, until nobody shows anything there any more.
class ViewStream : public TextStream {
 public:
  ViewStream(LiveShows& shows, std::string name) : shows_(shows), name_(std::move(name)) {}

  std::string next() override {
    const FileTime changed = shows_.changed(name_);
    const auto now = std::chrono::steady_clock::now();
    const bool fresh = changed != told_ && changed != FileTime();
    if (fresh || now - looked_ >= kShownAgain) {
      looked_ = now;
      view_ = shows_.look(name_);
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

  LiveShows& shows_;  // outlives every stream
  std::string name_;
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
    const auto png = shows_.picture(name_);
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
HttpResponse stream_of(LiveShows& shows, const std::string& name, const std::string& content_type) {
  if (const auto view = shows.look(name); !view) return problem(view.error());
  HttpResponse response;
  response.content_type = content_type;
  response.stream = std::make_unique<Stream>(shows, name);
  return response;
}

}  // namespace

HttpResponse view_answer(int status, const Result<nlohmann::json>& view) {
  if (!view) return problem(view.error());
  HttpResponse response;
  response.status = status;
  response.body = text_of_view(*view) + "\n";
  return response;
}

HttpResponse picture_of(LiveShows& shows, const std::string& name) {
  Result<std::string> png = shows.picture(name);
  if (!png) return problem(png.error());
  HttpResponse response;
  response.content_type = "image/png";
  response.body = *std::move(png);
  return response;
}

HttpResponse picture_stream(LiveShows& shows, const std::string& name) {
  return stream_of<PictureStream>(
      shows, name, fmt::format("multipart/x-mixed-replace; boundary={}", kBoundary));
}

HttpResponse figure_stream(LiveShows& shows, const std::string& name) {
  return stream_of<FigureStream>(shows, name, "text/event-stream");
}

bool is_json(const HttpRequest& request) {
  const auto type = request.headers.find("content-type");
  return type != request.headers.end() && type->second.starts_with("application/json");
}

HttpResponse not_json() {
  return problem(415, "unsupported_media_type", "expected Content-Type: application/json");
}

}  // namespace opaline::daemon
