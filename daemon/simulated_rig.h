#pragma once

#include <chrono>
#include <filesystem>
#include <memory>
#include <stop_token>
#include <string>
#include <vector>

#include "base/clock.h"
#include "base/events.h"
#include "base/result.h"
#include "config/rig_config.h"
#include "sim/rig.h"

namespace opaline::daemon {

/// A hash of everything that a simulated station is made from, by which release: its options, and the content of the
/// stored light transport that they name. Two of one identity give the same pixels.
std::string rig_identity(const config::SimConfig& sim);

/// Builds the station of a rig file. Its light transport is read, or computed with progress where it is not stored,
/// which may take long. Errors: kInvalidArgument, kCancelled, kUnavailable (disk).
Result<std::unique_ptr<sim::Rig>> build_rig(const config::SimConfig& sim,
                                            EventSink& events,
                                            std::stop_token stop,
                                            Clock* clock = nullptr);

/// How opaline-rig is started when nobody serves the station yet.
struct RigProcess {
  std::filesystem::path program;  ///< opaline-rig
  std::vector<std::string>
      arguments;                 ///< {"serve", "--session", DIR} or {"serve", "--config", FILE}
  std::filesystem::path socket;  ///< config::rig_socket()
  std::string identity;          ///< rig_identity()
  std::chrono::seconds patience{
      7200};  ///< until it answers: light transport may have to be computed
};

/// Returns once opaline-rig answers at the socket: at once when it does already. One of another identity is asked to
/// end first, so the caller holds the station's lock. The process started is nobody's child in the end: it outlives
/// the caller, has its own session, and writes its log to SOCKET.log.
///
/// Errors: kUnavailable, with the log's name, when it cannot be started or ends at once; kTimeout; kCancelled; after
/// each of these none is left that was started here. A rig that holds its lock but neither answers nor ends, as a
/// stopped process does, is a kTimeout after 10 s (or `patience`) that says so.
Result<void> ensure_rig_process(const RigProcess& process, std::stop_token stop);

}  // namespace opaline::daemon
