#pragma once

#include <atomic>
#include <chrono>
#include <filesystem>
#include <list>
#include <memory>
#include <stop_token>
#include <thread>

#include "base/file_descriptor.h"
#include "base/lock.h"
#include "base/result.h"
#include "sim/rig_message.h"
#include "sim/rig_port.h"

namespace opaline::sim {

/// Serves a rig on a Unix socket, to several clients at once. A client that goes away, however it does, ends its own
/// exposure and nothing else: the lamp stays as it is, as hardware's would.
///
/// Threads: one for each of up to 32 connections, which end with serve().
class RigServer {
 public:
  /// Takes SOCKET.lock and listens. The rig must outlive the server. Errors: kBusy when another rig serves there,
  /// kUnavailable when the path cannot be used.
  static Result<std::unique_ptr<RigServer>> create(RigPort& rig,
                                                   const std::filesystem::path& socket);
  ~RigServer();

  /// Serves until told to stop (by the token, or by a client), or until nobody has asked for anything for `idle` while the lamp is dark.
  Result<void> serve(std::chrono::nanoseconds idle, std::stop_token stop);

 private:
  struct Connection {
    std::atomic<bool> over = false;
    std::jthread thread;
  };
  RigServer(RigPort& rig, std::filesystem::path socket, FileLock lock, FileDescriptor listener)
      : rig_(rig),
        socket_(std::move(socket)),
        lock_(std::move(lock)),
        listener_(std::move(listener)) {}

  void accept_one(const std::stop_token& stop);
  RigMessage respond(const RigMessage& request, const std::stop_token& stop);
  void answer(int connection, std::stop_token stop) noexcept;
  Result<void> exchange(int connection, const std::stop_token& stop);
  bool idle_for(std::chrono::nanoseconds idle);

  RigPort& rig_;
  std::filesystem::path socket_;
  FileLock lock_;
  FileDescriptor listener_;
  std::atomic<bool> ending_ = false;
  Deadline last_request_ = std::chrono::steady_clock::now();
  std::list<Connection> connections_;
};

}  // namespace opaline::sim
