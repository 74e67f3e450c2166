#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>

#include "base/result.h"
#include "daemon/http_message.h"

namespace opaline::daemon {

/// Serves HTTP/1.1 on TCP and on a Unix socket, on the thread that calls run(): requests are
/// handled one after another, streams and downloads share the time between them.
///
/// Who may ask: everyone who can open the Unix socket, that is this user. Over TCP on a loopback
/// address every local user, but no web page of another site (Host and Origin are checked); with a
/// token, whoever sends "Authorization: Bearer TOKEN".
/// Everything is bounded: header 8 KiB, body 1 MiB, connections (over TCP eight fewer, so that this
/// user's socket always answers; who is one too many waits to be accepted), streams (503), and the
/// time for each read and write. What is not HTTP is answered 400, 408, 413 or 431 and closed.
class HttpServer {
 public:
  struct Options {
    std::string address = "127.0.0.1";  ///< empty: no TCP
    std::uint16_t port = 8787;          ///< 0: any free one
    std::filesystem::path socket;       ///< empty: no Unix socket
    std::string token;                  ///< needed for an address that is not loopback
    std::size_t max_connections = 64;
    std::size_t max_streams = 16;
    std::chrono::seconds read_deadline{30};   ///< for a request, from when it could begin
    std::chrono::seconds write_deadline{30};  ///< for each piece of a response
  };
  /// Called on run()'s thread; what it throws is answered 500.
  using Handler = std::function<HttpResponse(const HttpRequest&)>;

  /// Errors: kInvalidArgument for a bad address or a missing token, kBusy when another server is
  /// there already, kUnavailable.
  static Result<std::unique_ptr<HttpServer>> listen(const Options& options, Handler handler);
  ~HttpServer();
  HttpServer(const HttpServer&) = delete;
  HttpServer& operator=(const HttpServer&) = delete;

  /// The TCP port; 0 without TCP.
  std::uint16_t port() const;
  /// Serves until SIGTERM, SIGINT or stop().
  void run();
  /// Thread-safe.
  void stop();

 private:
  struct Impl;
  explicit HttpServer(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace opaline::daemon
