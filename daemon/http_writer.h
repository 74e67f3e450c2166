#pragma once

#include <chrono>
#include <cstddef>
#include <string>

#include "daemon/http_message.h"
#include "daemon/http_stream.h"

namespace opaline::daemon {

/// Writes responses to connections: a text, a file, or a stream for as long as it goes on. Each piece
/// has a deadline; an error closes the connection. For http_server.cc alone; one thread.
class HttpWriter {
 public:
  explicit HttpWriter(std::chrono::seconds deadline) : deadline_(deadline) {}

  http_detail::net::awaitable<void> write(http_detail::Stream& stream,
                                          HttpResponse& response,
                                          bool keep_alive);
  /// What GET would say of its body, and no body.
  http_detail::net::awaitable<void> write_head(http_detail::Stream& stream,
                                               const HttpResponse& response,
                                               bool keep_alive);
  /// Says that nothing comes any more, and drops what the peer still sends, so that it gets to read
  /// our answer.
  static http_detail::net::awaitable<void> linger(http_detail::Stream& stream);
  /// How many streams are being written.
  std::size_t streams() const { return streams_; }

 private:
  http_detail::net::awaitable<void> write_file(http_detail::Stream& stream,
                                               OpenArtefact& file,
                                               http_detail::error_code& error) const;
  http_detail::net::awaitable<void> write_stream(http_detail::Stream& stream,
                                                 TextStream& text,
                                                 http_detail::error_code& error);
  http_detail::net::awaitable<void> write_chunk(http_detail::Stream& stream,
                                                const std::string& text,
                                                http_detail::error_code& error) const;

  std::chrono::seconds deadline_;
  std::size_t streams_ = 0;
};

}  // namespace opaline::daemon
