#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>

#include "base/session_directory.h"
#include "daemon/session_history.h"

namespace opaline::daemon {

/// What is known of a session at one moment; a value.
struct SessionSnapshot {  // NOLINT(bugprone-exception-escape): a null JSON value throws nothing
  std::string id;
  std::string name;
  std::string directory;
  SessionState state = SessionState::kQueued;
  std::string stage;    ///< running, next, or the one that ended the session
  std::string message;  ///< why it failed or was cancelled, or what it waits for
  std::string code;     ///< of the error, when it failed
  nlohmann::json progress;
  std::array<Stage, kStages.size()> stages;
  std::uint64_t last_seq = 0;  ///< of the event log
};

SessionSnapshot make_snapshot(const SessionDirectory& session,
                              const SessionHistory& history,
                              const Decision& decision);

/// Reads a session as it is now: its event log and whether a job holds its lock.
Result<SessionSnapshot> read_snapshot(const SessionDirectory& session);

/// As the API shows it (docs/api.md).
nlohmann::json to_json(const SessionSnapshot& snapshot);

}  // namespace opaline::daemon
