#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <nlohmann/json.hpp>
#include <thread>

#include "base/file_descriptor.h"
#include "base/result.h"

namespace opaline::daemon {

/// A running job's own socket. Both directions carry one JSON object a line:
///   -> {"command":"cancel"}   <- {"ok":true}
///   -> {"command":"status"}   <- {"ok":true,"job":"capture","pid":4711,"progress":{...}}
///   -> anything else          <- {"ok":false,"error":{"code":"invalid_argument","message":"..."}}
/// A line has at most 4096 bytes, a connection that is silent for 5 s is closed, and 8 are served
/// at a time.
class ControlServer {
 public:
  /// Answers one request; called on the server's thread.
  using Handler = std::function<nlohmann::json(const nlohmann::json& request)>;

  static Result<std::unique_ptr<ControlServer>> start(const std::filesystem::path& socket,
                                                      Handler handler);
  /// Stops the thread and removes the socket.
  ~ControlServer();
  ControlServer(const ControlServer&) = delete;
  ControlServer& operator=(const ControlServer&) = delete;

 private:
  ControlServer(std::filesystem::path socket,
                FileDescriptor listener,
                FileDescriptor wake,
                Handler handler);

  std::filesystem::path socket_;
  FileDescriptor listener_;
  FileDescriptor wake_;
  Handler handler_;
  std::jthread thread_;  // last: joins first
};

/// {"ok":false,"error":{...}}
nlohmann::json control_error(const Error& error);

}  // namespace opaline::daemon
