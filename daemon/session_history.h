#pragma once

#include <array>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

#include "base/event_log.h"

namespace opaline::daemon {

/// The programs a session runs through, in order: opaline-capture, ...
inline constexpr std::array<std::string_view, 3> kStages{"capture", "reconstruct", "preview"};
/// The stage that needs the station's devices.
inline constexpr std::string_view kStationStage = "capture";

enum class StageState : std::uint8_t {
  kPending,      ///< not started, or asked to start again
  kStarted,      ///< started and not finished: running, or died
  kInterrupted,  ///< stopped by a signal before it was done; to be started again
  kBusy,         ///< found its station in use; to be started again later
  kSucceeded,
  kFailed,
  kCancelled,
};
std::string_view to_string(StageState state);

struct Stage {
  StageState state = StageState::kPending;
  int fruitless = 0;     ///< runs in a row that ended unfinished and logged no fact of their own
  std::string message;   ///< how it ended, for people
  std::string code;      ///< of the error it ended with
  std::string started;   ///< UTC of the first start; empty before
  std::string finished;  ///< UTC of the last finish; empty before
};

/// What a session's event log says about its stages: a fold over the events. The facts it knows are
/// job.started, job.finished and job.cancel_requested (daemon/jobs/job.h), and the supervisor's own
///   session.cancelled  no stage is to be started any more
///   session.resumed    what failed or was cancelled may be tried again
/// Any other fact counts as work done; progress, plans and what has to be taken again do not. A run
/// that a signal ended (somebody wanted the machine) says nothing about the stage.
class SessionHistory {  // NOLINT(bugprone-exception-escape): a null JSON value throws nothing
 public:
  void apply(const Event& event);

  const std::array<Stage, kStages.size()>& stages() const { return stages_; }
  /// Of the stage that was started last; null when there is none.
  const nlohmann::json& progress() const { return progress_; }
  bool cancel_requested() const { return cancel_requested_; }
  bool cancelled() const { return cancelled_; }
  std::uint64_t last_seq() const { return last_seq_; }

 private:
  void on_started(Stage& stage, const Event& event);
  void on_finished(Stage& stage, const Event& event);
  void on_resumed();

  std::array<Stage, kStages.size()> stages_;
  nlohmann::json progress_;
  bool cancel_requested_ = false;
  bool cancelled_ = false;
  std::uint64_t last_seq_ = 0;
};

enum class SessionState : std::uint8_t {
  kQueued,   ///< the next stage will be started
  kWaiting,  ///< for its station, which another session uses
  kRunning,
  kCancelling,  ///< running, and asked to stop
  kSucceeded,
  kFailed,
  kCancelled,
};
std::string_view to_string(SessionState state);
constexpr bool is_over(SessionState state) { return state >= SessionState::kSucceeded; }

/// What is to be done about a session.
enum class Action : std::uint8_t {
  kNone,         ///< it is over, or a job works on it
  kStart,        ///< start `stage`
  kGiveUp,       ///< log that `stage` failed: it died too often without getting anywhere
  kCloseCancel,  ///< log that the session is cancelled: nothing runs any more
};

struct Decision {
  SessionState state = SessionState::kQueued;
  Action action = Action::kNone;
  std::size_t stage = 0;  ///< the one running, to be started, or that ended the session
};

/// A stage that died is started again until this many runs in a row logged no fact.
inline constexpr int kFruitlessRuns = 3;

/// `alive`: a job holds the session's lock, or has been started and not ended yet. `cancel_wished`:
/// is_cancel_wished(), looked at after the log, since a resume forgets the wish before it says so.
Decision decide(const SessionHistory& history, bool alive, bool cancel_wished);

}  // namespace opaline::daemon
