#pragma once

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

/// Follows a session of the daemon until it is over, with live progress on the terminal. Ctrl-C
/// asks to cancel, a second one leaves the session to the daemon. A daemon that goes away is waited
/// for, ten seconds.
Result<Ending> follow_session(const DaemonAddress& daemon, const std::string& id);

/// Takes a session through its stages without a daemon, with the same progress. Ctrl-C asks to
/// cancel; a second one, or SIGTERM, leaves a running job to itself.
Result<Ending> run_locally(const SessionDirectory& session,
                           const std::filesystem::path& programs,
                           const std::filesystem::path& station_lock);

}  // namespace opaline::daemon
