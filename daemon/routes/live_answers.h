#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "base/result.h"
#include "daemon/http_message.h"
#include "daemon/live_shows.h"

/// What routes answer about pictures that are shown live. A stream's show must outlive it.
namespace opaline::daemon {

HttpResponse view_answer(int status, const Result<nlohmann::json>& view);
/// The newest picture, PNG.
HttpResponse picture_of(LiveShows& shows, const std::string& name);
/// multipart/x-mixed-replace of PNG, as they come.
HttpResponse picture_stream(LiveShows& shows, const std::string& name);
/// text/event-stream: `view` as figures come, and `over` at the end.
HttpResponse figure_stream(LiveShows& shows, const std::string& name);

bool is_json(const HttpRequest& request);
HttpResponse not_json();  ///< 415

}  // namespace opaline::daemon
