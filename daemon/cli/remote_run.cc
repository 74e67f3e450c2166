#include <fmt/format.h>

#include <atomic>
#include <csignal>
#include <optional>
#include <stop_token>

#include "daemon/cli/run.h"
#include "daemon/cli/terminal.h"
#include "daemon/jobs/stop_signals.h"
#include "daemon/json_text.h"
#include "daemon/session_history.h"

namespace opaline::daemon {
namespace {

constexpr int kReconnects = 10;
constexpr std::chrono::seconds kReconnectPause{1};

bool is_over_named(std::string_view state) {
  return state == to_string(SessionState::kSucceeded) ||
         state == to_string(SessionState::kFailed) || state == to_string(SessionState::kCancelled);
}

Ending ending_of(const nlohmann::json& session) {
  return {text_of(session, "id"),
          text_of(session, "directory"),
          text_of(session, "state"),
          text_of(session, "message")};
}

/// Follows one session over as many connections as it takes.
class Follower {
 public:
  Follower(const DaemonAddress& address, std::string id, OnInterrupt on_interrupt)
      : address_(address),
        id_(std::move(id)),
        on_interrupt_(on_interrupt),
        view_(terminal_options(), clock_) {}

  Result<Ending> run() {
    auto signals = StopSignals::watch([this](int signal) { on_signal(signal); });
    if (!signals) return signals.error();
    const DaemonClient client(address_);
    for (int failures = 0;;) {
      const std::uint64_t before = last_;
      const Result<void> followed = client.follow(
          fmt::format("/v1/sessions/{}/events?since={}", id_, last_),
          [this](const ServerEvent& event) { on_event(event); },
          leave_.get_token());
      if (problem_) return problem_->in("session " + id_);
      if (is_over_named(ending_.state) || leave_.stop_requested()) break;
      if (!followed && followed.error().code != ErrorCode::kUnavailable) return followed.error();
      failures = last_ > before ? 1 : failures + 1;
      if (failures > kReconnects) return gone(followed);
      if (failures == 1) view_.say("the daemon is not answering; its jobs go on; trying again");
      clock_.sleep(kReconnectPause, leave_.get_token());
    }
    ending_.id = id_;
    return ending_;
  }

 private:
  void on_event(const ServerEvent& event) {
    if (event.id) last_ = *event.id;
    const auto json = nlohmann::json::parse(event.data, nullptr, false);
    if (!json.is_object()) return;
    if (event.type == "state") {
      ending_ = ending_of(json);
      view_.on_state(json);
    } else if (json.contains("data")) {
      view_.on_event(event.type, json["data"]);
    } else if (event.type == "error") {
      problem_ = unavailable(text_of(json, "message"));
    }
  }

  // On the signals' thread, with a connection of its own.
  void on_signal(int signal) {
    if (on_interrupt_ == OnInterrupt::kLeave || signal == SIGTERM || cancel_sent_.exchange(true)) {
      leave_.request_stop();
      return;
    }
    const auto answer = DaemonClient(address_).post(fmt::format("/v1/sessions/{}/cancel", id_), {});
    if (!answer) fmt::print(stderr, "cancel: {}\n", answer.error().message);
  }

  Error gone(const Result<void>& followed) const {
    return unavailable(fmt::format("session {}: {}; watch it later with \"opaline watch {}\"",
                                   id_,
                                   followed ? "the stream ended early" : followed.error().message,
                                   id_));
  }

  DaemonAddress address_;
  std::string id_;
  OnInterrupt on_interrupt_;
  SystemClock clock_;
  ProgressView view_;
  std::stop_source leave_;
  std::atomic<bool> cancel_sent_ = false;
  std::uint64_t last_ = 0;
  Ending ending_;
  std::optional<Error> problem_;  // that the daemon has with the session
};

}  // namespace

Result<Ending> follow_session(const DaemonAddress& daemon,
                              const std::string& id,
                              OnInterrupt on_interrupt) {
  return Follower(daemon, id, on_interrupt).run();
}

}  // namespace opaline::daemon
