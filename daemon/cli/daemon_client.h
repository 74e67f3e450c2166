#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <nlohmann/json.hpp>
#include <stop_token>
#include <string>

#include "base/result.h"
#include "daemon/cli/sse_parser.h"

namespace opaline::daemon {

/// Where a daemon is.
struct DaemonAddress {
  std::filesystem::path socket;
  std::string url;    ///< "http://station:8787"; empty: the socket
  std::string token;  ///< for the URL
};

/// Asks opalined. Every call has a deadline. Errors: kUnavailable when it is not there (and what to
/// do about that), or what it answered. Threads: separate objects only.
class DaemonClient {
 public:
  explicit DaemonClient(DaemonAddress address) : address_(std::move(address)) {}

  Result<nlohmann::json> get(const std::string& path) const;
  /// An empty body is sent as none.
  Result<nlohmann::json> post(const std::string& path, const nlohmann::json& body) const;
  /// Follows a stream of events until the daemon ends it or a stop is requested (kCancelled);
  /// kUnavailable when it breaks.
  Result<void> follow(const std::string& path,
                      const std::function<void(const ServerEvent&)>& on_event,
                      std::stop_token stop) const;

 private:
  DaemonAddress address_;
};

}  // namespace opaline::daemon
