#include "daemon/routes/events.h"

#include <fmt/format.h>

#include <charconv>
#include <deque>
#include <iterator>
#include <utility>

#include "base/lock.h"
#include "daemon/cancel_wish.h"
#include "daemon/event_follower.h"
#include "daemon/problem.h"

namespace opaline::daemon {
namespace {

constexpr std::size_t kEventsAtOnce = 500;

std::string dump(const nlohmann::json& json) {
  return json.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

/// A session's log as it grows, and its state as it changes, until it is over.
class SessionEvents : public TextStream {
 public:
  SessionEvents(SessionDirectory session, const Station& station, std::uint64_t since)
      : session_(std::move(session)),
        station_(station),
        since_(since),
        follower_(session_.events()) {}

  std::string next() override {
    std::string text;
    const SessionSnapshot snapshot = look(text);
    for (std::size_t n = 0; n < kEventsAtOnce && !pending_.empty(); ++n) {
      const Event& event = pending_.front();
      const nlohmann::json data{
          {"seq", event.seq}, {"time", event.time}, {"type", event.type}, {"data", event.data}};
      text += fmt::format("id: {}\nevent: {}\ndata: {}\n\n", event.seq, event.type, dump(data));
      pending_.pop_front();
    }
    if (!pending_.empty() || over_) return text;
    tell_state(snapshot, text);
    over_ = is_over(snapshot.state);
    return text;
  }
  bool is_over() const override { return over_; }

 private:
  static bool is_over(SessionState state) { return daemon::is_over(state); }

  SessionSnapshot look(std::string& text) {
    const Result<bool> held = FileLock::is_held(session_.lock());  // before the log
    Result<std::vector<Event>> events = follower_.poll();
    if (!events) {
      text +=
          fmt::format("event: error\ndata: {}\n\n", dump({{"message", events.error().message}}));
      over_ = true;
    } else {
      for (Event& event : *events) {
        history_.apply(event);
        if (event.seq > since_) pending_.push_back(std::move(event));
      }
    }
    const Decision decision = decide(history_, held && *held, is_cancel_wished(session_));
    SessionSnapshot snapshot = make_snapshot(session_, history_, decision);
    station_.refine(snapshot);
    return snapshot;
  }

  void tell_state(const SessionSnapshot& snapshot, std::string& text) {
    const auto state = std::pair(snapshot.state, snapshot.stage);
    if (told_ == state) return;
    told_ = state;
    text += fmt::format("event: state\ndata: {}\n\n", dump(to_json(snapshot)));
  }

  SessionDirectory session_;
  const Station& station_;  // outlives every stream
  std::uint64_t since_;
  EventFollower follower_;
  SessionHistory history_;
  std::deque<Event> pending_;
  std::optional<std::pair<SessionState, std::string>> told_;
  bool over_ = false;
};

Result<std::uint64_t> since_of(const HttpRequest& request) {
  const auto header = request.headers.find("last-event-id");
  const auto query = request.query.find("since");
  const std::string text = header != request.headers.end() ? header->second
                           : query != request.query.end()  ? query->second
                                                           : "0";
  std::uint64_t since = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), since);
  if (error != std::errc() || end != text.data() + text.size()) {
    return invalid_argument(fmt::format("since = \"{}\"; expected an event's number", text));
  }
  return since;
}

HttpResponse follow(Station& station, const HttpRequest& request, const std::string& id) {
  const Result<SessionDirectory> session = station.directory(id);
  if (!session) return problem(session.error());
  const Result<std::uint64_t> since = since_of(request);
  if (!since) return problem(since.error());
  HttpResponse response;
  response.content_type = "text/event-stream";
  response.stream = std::make_unique<SessionEvents>(*session, station, *since);
  return response;
}

}  // namespace

void add_event_routes(Router& router, Station& station) {
  router.add("GET",
             "/v1/sessions/{id}/events",
             [&](const HttpRequest& request, const Router::Parameters& p) {
               return follow(station, request, p[0]);
             });
}

}  // namespace opaline::daemon
