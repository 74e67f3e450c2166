#include "daemon/cli/daemon_client.h"

#include <curl/curl.h>
#include <fmt/format.h>

#include <memory>
#include <mutex>
#include <utility>

#include "daemon/json_text.h"

namespace opaline::daemon {
namespace {

constexpr std::size_t kAnswerLimit = 64u << 20;
constexpr long kConnectDeadlineMs = 5000;
constexpr long kDeadlineMs = 30000;
constexpr long kSilenceSeconds = 30;  // the daemon sends something every five

/// One request: libcurl's handle with its headers, and where the answer goes.
class Request {
 public:
  using OnText = std::function<bool(std::string_view)>;  // false stops it

  Request(const DaemonAddress& address, const std::string& path, OnText on_text)
      : on_text_(std::move(on_text)) {
    static std::once_flag once;
    std::call_once(once, [] { curl_global_init(CURL_GLOBAL_DEFAULT); });
    handle_ = curl_easy_init();
    const bool over_socket = address.url.empty();
    set(CURLOPT_URL, ((over_socket ? "http://localhost" : address.url) + path).c_str());
    if (over_socket) set(CURLOPT_UNIX_SOCKET_PATH, address.socket.c_str());
    set(CURLOPT_NOSIGNAL, 1L);
    set(CURLOPT_NOPROXY, "*");
    set(CURLOPT_CONNECTTIMEOUT_MS, kConnectDeadlineMs);
    set(CURLOPT_WRITEFUNCTION, &Request::on_write);
    set(CURLOPT_WRITEDATA, this);
    if (!address.token.empty()) add_header("Authorization: Bearer " + address.token);
  }
  ~Request() {
    curl_slist_free_all(headers_);
    curl_easy_cleanup(handle_);
  }
  Request(const Request&) = delete;
  Request& operator=(const Request&) = delete;

  template <class T>
  void set(CURLoption option, T value) {
    curl_easy_setopt(handle_, option, value);
  }
  void add_header(const std::string& line) { headers_ = curl_slist_append(headers_, line.c_str()); }
  void stop_with(const std::stop_token& stop) {
    stop_ = &stop;
    set(CURLOPT_NOPROGRESS, 0L);
    set(CURLOPT_XFERINFOFUNCTION, &Request::on_progress);
    set(CURLOPT_XFERINFODATA, this);
  }
  CURLcode perform() {
    set(CURLOPT_HTTPHEADER, headers_);
    return curl_easy_perform(handle_);
  }
  long status() const {
    long status = 0;
    curl_easy_getinfo(handle_, CURLINFO_RESPONSE_CODE, &status);
    return status;
  }

 private:
  static std::size_t on_write(char* data, std::size_t size, std::size_t count, void* self) {
    const std::string_view text(data, size * count);
    return static_cast<Request*>(self)->on_text_(text) ? text.size() : 0;
  }
  static int on_progress(void* self,
                         curl_off_t /*total*/,
                         curl_off_t /*now*/,
                         curl_off_t /*up*/,
                         curl_off_t /*sent*/) {
    return static_cast<Request*>(self)->stop_->stop_requested() ? 1 : 0;
  }

  OnText on_text_;
  CURL* handle_ = nullptr;
  curl_slist* headers_ = nullptr;
  const std::stop_token* stop_ = nullptr;
};

Error not_there(const DaemonAddress& address, CURLcode code) {
  return unavailable(
      fmt::format("no opalined at {} ({}): start one with \"opalined\", or run without one: "
                  "\"opaline run --local CONFIG\"",
                  address.url.empty() ? address.socket.string() : address.url,
                  curl_easy_strerror(code)));
}

ErrorCode code_named(const std::string& name) {
  for (int code = 0; code < static_cast<int>(ErrorCode::kInternal); ++code) {
    if (to_string(static_cast<ErrorCode>(code)) == name) return static_cast<ErrorCode>(code);
  }
  return ErrorCode::kInternal;
}

Result<nlohmann::json> parsed(long status, const std::string& text) {
  auto json = nlohmann::json::parse(text, nullptr, false);
  if (status < 300 && !json.is_object()) {
    return internal_error("the daemon's answer is no JSON object; is it another program?");
  }
  if (status < 300) return json;
  if (!json.is_object()) return internal_error(fmt::format("the daemon answered {}", status));
  const std::string detail = text_of(json, "detail");
  return Error{code_named(text_of(json, "code")), detail.empty() ? "the daemon refused" : detail};
}

Result<nlohmann::json> ask(Request& request, const DaemonAddress& address, std::string& text) {
  request.set(CURLOPT_TIMEOUT_MS, kDeadlineMs);
  const CURLcode code = request.perform();
  if (code == CURLE_OPERATION_TIMEDOUT) return timeout("the daemon did not answer in time");
  if (code != CURLE_OK) return not_there(address, code);
  return parsed(request.status(), text);
}

Request::OnText append_to(std::string& text) {
  return [&text](std::string_view piece) {
    text += piece;
    return text.size() <= kAnswerLimit;
  };
}

}  // namespace

Result<nlohmann::json> DaemonClient::get(const std::string& path) const {
  std::string text;
  Request request(address_, path, append_to(text));
  return ask(request, address_, text);
}

Result<nlohmann::json> DaemonClient::post(const std::string& path,
                                          const nlohmann::json& body) const {
  std::string text;
  Request request(address_, path, append_to(text));
  const std::string sent = body.empty() ? "" : body.dump();
  request.set(CURLOPT_POSTFIELDSIZE, static_cast<long>(sent.size()));
  request.set(CURLOPT_POSTFIELDS, sent.c_str());
  request.add_header("Content-Type: application/json");
  request.add_header("Expect:");
  return ask(request, address_, text);
}

Result<void> DaemonClient::follow(const std::string& path,
                                  const std::function<void(const ServerEvent&)>& on_event,
                                  std::stop_token stop) const {
  SseParser parser(on_event);
  std::string problem;
  Request* self = nullptr;
  Request request(address_, path, [&](std::string_view piece) {
    if (self->status() != 200) {
      problem += piece;
    } else {
      parser.feed(piece);
    }
    return problem.size() <= kAnswerLimit;
  });
  self = &request;
  request.stop_with(stop);
  request.set(CURLOPT_LOW_SPEED_LIMIT, 1L);
  request.set(CURLOPT_LOW_SPEED_TIME, kSilenceSeconds);
  const CURLcode code = request.perform();
  if (stop.stop_requested()) return cancelled("stopped following");
  if (code != CURLE_OK) return not_there(address_, code);
  const Result<nlohmann::json> answer =
      request.status() == 200 ? nlohmann::json() : parsed(request.status(), problem);
  return answer ? ok() : Result<void>(answer.error());
}

}  // namespace opaline::daemon
