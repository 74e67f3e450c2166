#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "base/session_directory.h"
#include "daemon/cli/daemon_client.h"

namespace opaline::daemon {

/// Where a session stood when it was no longer followed.
struct Ending {
  std::string id;
  std::filesystem::path directory;
  std::string state;  ///< to_string(SessionState); not over when the follower left early
  std::string message;
};

/// What Ctrl-C does to the session that is followed.
enum class OnInterrupt : std::uint8_t {
  kCancel,  ///< cancels it; a second one leaves it to the daemon
  kLeave,   ///< leaves it to the daemon at once
};

/// Follows a session of the daemon until it is over, with live progress on the terminal. A daemon
/// that goes away is waited for, ten seconds. Errors: also what the daemon cannot do with the
/// session, its log being damaged.
Result<Ending> follow_session(const DaemonAddress& daemon,
                              const std::string& id,
                              OnInterrupt on_interrupt);

/// Takes a session through its stages without a daemon, with the same progress, from where it
/// stands; a step that fails for the moment is told and tried again. Ctrl-C asks to cancel; a second
/// one, or SIGTERM, leaves a running job to itself.
Result<Ending> run_locally(const SessionDirectory& session,
                           const std::filesystem::path& programs,
                           const std::filesystem::path& station_lock);

/// Lets run_locally() try again what failed or was cancelled. kBusy while a job works on it.
Result<void> resume_locally(const SessionDirectory& session);

}  // namespace opaline::daemon
