#include "daemon/http_writer.h"

#include <unistd.h>

#include <algorithm>
#include <boost/asio/write.hpp>
#include <cstdint>
#include <utility>
#include <vector>

namespace opaline::daemon {
namespace {

using namespace http_detail;  // NOLINT(google-build-using-namespace)

constexpr std::size_t kFileChunk = 64u << 10;
constexpr std::size_t kBusyStream = 32u << 10;
constexpr std::chrono::milliseconds kStreamPeriod{100};
constexpr int kPeriodsPerHeartbeat = 50;
constexpr std::chrono::seconds kLingerDeadline{2};
constexpr std::size_t kLingerLimit = 4u << 20;

template <class Body>
void fill_head(http::response<Body>& head, const HttpResponse& response, bool keep_alive) {
  head.version(11);
  head.result(static_cast<unsigned>(response.status));
  head.keep_alive(keep_alive);
  head.set(http::field::content_type, response.content_type);
  head.set(http::field::cache_control, "no-store");
  head.set("X-Content-Type-Options", "nosniff");
  for (const auto& [name, value] : response.headers) head.set(name, value);
}

}  // namespace

// Errors of writing end the connection, and are found by the next read.
net::awaitable<void> HttpWriter::write(Stream& stream, HttpResponse& response, bool keep_alive) {
  error_code error;
  stream.expires_after(deadline_);
  if (!response.file && response.stream == nullptr) {
    http::response<http::string_body> message;
    fill_head(message, response, keep_alive);
    message.body() = std::move(response.body);
    message.prepare_payload();
    co_await http::async_write(stream, message, into(error));
    co_return;
  }
  http::response<http::empty_body> head;
  fill_head(head, response, keep_alive);
  if (response.file) {
    head.content_length(response.file->size);
  } else {
    head.chunked(true);
  }
  http::response_serializer<http::empty_body> serializer(head);
  co_await http::async_write_header(stream, serializer, into(error));
  if (!error && response.file) co_await write_file(stream, *response.file, error);
  if (!error && response.stream != nullptr) co_await write_stream(stream, *response.stream, error);
  if (error) stream.close();
}

net::awaitable<void> HttpWriter::write_head(Stream& stream,
                                            const HttpResponse& response,
                                            bool keep_alive) {
  http::response<http::empty_body> head;
  fill_head(head, response, keep_alive);
  if (response.stream != nullptr) {
    head.chunked(true);
  } else {
    head.content_length(response.file ? response.file->size : response.body.size());
  }
  error_code error;
  stream.expires_after(deadline_);
  http::response_serializer<http::empty_body> serializer(head);
  co_await http::async_write_header(stream, serializer, into(error));
}

// Exactly as many bytes as were announced; a file that has shrunk breaks the connection.
net::awaitable<void> HttpWriter::write_file(Stream& stream,
                                            OpenArtefact& file,
                                            error_code& error) const {
  std::vector<char> chunk(kFileChunk);
  std::uint64_t left = file.size;
  while (left > 0 && !error) {
    const std::size_t want = static_cast<std::size_t>(std::min<std::uint64_t>(left, chunk.size()));
    const ssize_t got = ::read(file.file.get(), chunk.data(), want);
    if (got <= 0) {
      error = net::error::eof;
      co_return;
    }
    stream.expires_after(deadline_);
    const net::const_buffer bytes(chunk.data(), static_cast<std::size_t>(got));
    co_await net::async_write(stream, bytes, into(error));
    left -= static_cast<std::uint64_t>(got);
  }
}

net::awaitable<void> HttpWriter::write_stream(Stream& stream, TextStream& text, error_code& error) {
  const Counted counted(streams_);
  net::steady_timer timer(stream.get_executor());
  for (int silent = 0; !error; ++silent) {
    std::string next = text.next();
    const bool more = next.size() >= kBusyStream;
    if (next.empty() && silent >= kPeriodsPerHeartbeat) next = ": still here\n\n";
    if (!next.empty()) {
      silent = 0;
      co_await write_chunk(stream, next, error);
    }
    if (text.is_over()) break;
    if (more) continue;
    timer.expires_after(kStreamPeriod);
    co_await timer.async_wait(into(error));
  }
  if (error) co_return;
  stream.expires_after(deadline_);
  const auto last = http::make_chunk_last();
  co_await net::async_write(stream, last, into(error));
}

net::awaitable<void> HttpWriter::write_chunk(Stream& stream,
                                             const std::string& text,
                                             error_code& error) const {
  stream.expires_after(deadline_);
  const net::const_buffer bytes(text.data(), text.size());
  const auto chunk = http::make_chunk(bytes);
  co_await net::async_write(stream, chunk, into(error));
}

net::awaitable<void> HttpWriter::linger(Stream& stream) {
  error_code error;
  stream.socket().shutdown(Generic::socket::shutdown_send, error);
  std::vector<char> dropped(kFileChunk);
  stream.expires_after(kLingerDeadline);
  for (std::size_t total = 0; !error && total < kLingerLimit;) {
    const net::mutable_buffer space(dropped.data(), dropped.size());
    total += co_await stream.async_read_some(space, into(error));
  }
  stream.close();
}

}  // namespace opaline::daemon
