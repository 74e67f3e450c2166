#pragma once

#include <filesystem>

#include "base/result.h"

namespace opaline::daemon {

/// This user's directory for sockets: $XDG_RUNTIME_DIR/opaline, or without that /tmp/opaline-UID;
/// made if missing, and refused unless it is ours alone.
Result<std::filesystem::path> runtime_directory();

/// Where opalined listens and opaline asks: $OPALINE_SOCKET, or opalined.sock in the above.
Result<std::filesystem::path> default_socket();

/// Where stations show what their cameras see just now (daemon/live_view.h): live in the above.
Result<std::filesystem::path> live_root();

/// Where sessions lie unless told otherwise: $OPALINE_SESSIONS, $XDG_DATA_HOME/opaline/sessions or
/// ~/.local/share/opaline/sessions.
std::filesystem::path default_sessions();

/// Where the calibrations of all stations lie unless told otherwise: $OPALINE_CALIBRATIONS, $XDG_DATA_HOME/opaline/calibrations
/// or ~/.local/share/opaline/calibrations.
std::filesystem::path default_calibrations();

}  // namespace opaline::daemon
