#include "daemon/session_history.h"

#include <algorithm>

#include "daemon/json_text.h"

namespace opaline::daemon {
namespace {

StageState ended_as(const nlohmann::json& data) {
  const std::string outcome = text_of(data, "outcome");
  if (outcome == "succeeded") return StageState::kSucceeded;
  if (outcome == "cancelled") {
    return text_of(data, "by") == "signal" ? StageState::kInterrupted : StageState::kCancelled;
  }
  return text_of(data, "code") == "busy" ? StageState::kBusy : StageState::kFailed;
}

std::size_t first_in(const SessionHistory& history, StageState state) {
  const auto& stages = history.stages();
  const auto it = std::ranges::find(stages, state, &Stage::state);
  return static_cast<std::size_t>(it - stages.begin());
}

std::size_t first_unfinished(const SessionHistory& history) {
  const auto& stages = history.stages();
  const auto it = std::ranges::find_if(
      stages, [](const Stage& stage) { return stage.state != StageState::kSucceeded; });
  return static_cast<std::size_t>(it - stages.begin());
}

// Every other fact is work done that the next run need not do again.
bool is_fruit(std::string_view type) {
  constexpr std::array<std::string_view, 5> kNone{
      "capture.planned", "region.damaged", "region.retaken", "region.unsteady", "sample.moved"};
  return std::ranges::find(kNone, type) == kNone.end();
}

Decision decide_next(const SessionHistory& history) {
  const std::size_t next = first_unfinished(history);
  if (next == kStages.size()) return {SessionState::kSucceeded, Action::kNone, next - 1};
  const bool hopeless = history.stages()[next].fruitless >= kFruitlessRuns;
  return {SessionState::kQueued, hopeless ? Action::kGiveUp : Action::kStart, next};
}

}  // namespace

std::string_view to_string(StageState state) {
  switch (state) {
    case StageState::kPending:
      return "pending";
    case StageState::kStarted:
      return "started";
    case StageState::kInterrupted:
      return "interrupted";
    case StageState::kBusy:
      return "waiting";
    case StageState::kSucceeded:
      return "succeeded";
    case StageState::kFailed:
      return "failed";
    case StageState::kCancelled:
      return "cancelled";
  }
  return "pending";
}

std::string_view to_string(SessionState state) {
  switch (state) {
    case SessionState::kQueued:
      return "queued";
    case SessionState::kWaiting:
      return "waiting for station";
    case SessionState::kRunning:
      return "running";
    case SessionState::kCancelling:
      return "cancelling";
    case SessionState::kSucceeded:
      return "succeeded";
    case SessionState::kFailed:
      return "failed";
    case SessionState::kCancelled:
      return "cancelled";
  }
  return "queued";
}

void SessionHistory::apply(const Event& event) {
  last_seq_ = event.seq;
  if (event.type == "progress") {
    progress_ = event.data;
    return;
  }
  const auto named = std::ranges::find(kStages, text_of(event.data, "job"));
  Stage* stage = named == kStages.end() ? nullptr : &stages_[named - kStages.begin()];
  if (event.type == "job.started") {
    if (stage != nullptr) on_started(*stage, event);
  } else if (event.type == "job.finished") {
    if (stage != nullptr) on_finished(*stage, event);
  } else if (event.type == "job.cancel_requested") {
    cancel_requested_ = true;
  } else if (event.type == "session.cancelled") {
    cancelled_ = true;
  } else if (event.type == "session.resumed") {
    on_resumed();
  } else if (is_fruit(event.type)) {
    for (Stage& any : stages_) any.fruitless = 0;
  }
}

// Counted at the start of a run, taken back when the run shows anything for itself.
void SessionHistory::on_started(Stage& stage, const Event& event) {
  stage.state = StageState::kStarted;
  ++stage.fruitless;
  if (stage.started.empty()) stage.started = event.time;
  stage.message.clear();
  stage.code.clear();
  progress_ = nullptr;
}

void SessionHistory::on_finished(Stage& stage, const Event& event) {
  stage.state = ended_as(event.data);
  stage.message = text_of(event.data, "message");
  stage.code = text_of(event.data, "code");
  stage.finished = event.time;
  if (stage.state == StageState::kBusy) stage.fruitless = 0;
  if (stage.state == StageState::kInterrupted && stage.fruitless > 0) --stage.fruitless;
  if (stage.state == StageState::kSucceeded) stage.fruitless = 0;
}

void SessionHistory::on_resumed() {
  cancelled_ = false;
  cancel_requested_ = false;
  for (Stage& stage : stages_) {
    stage.fruitless = 0;
    if (stage.state != StageState::kSucceeded) stage.state = StageState::kPending;
  }
}

Decision decide(const SessionHistory& history, bool alive, bool cancel_wished) {
  const std::size_t last = kStages.size() - 1;
  const bool cancelling = cancel_wished || history.cancel_requested();
  if (alive) {
    const std::size_t started = first_in(history, StageState::kStarted);
    const std::size_t running =
        started <= last ? started : std::min(first_unfinished(history), last);
    return {
        cancelling ? SessionState::kCancelling : SessionState::kRunning, Action::kNone, running};
  }
  const std::size_t failed = first_in(history, StageState::kFailed);
  if (failed < kStages.size()) return {SessionState::kFailed, Action::kNone, failed};
  const std::size_t cancelled = first_in(history, StageState::kCancelled);
  if (cancelled < kStages.size()) return {SessionState::kCancelled, Action::kNone, cancelled};
  const std::size_t next = std::min(first_unfinished(history), last);
  if (history.cancelled()) return {SessionState::kCancelled, Action::kNone, next};
  const Decision decision = decide_next(history);
  if (cancelling && !is_over(decision.state)) {
    return {SessionState::kCancelling, Action::kCloseCancel, decision.stage};
  }
  return decision;
}

}  // namespace opaline::daemon
