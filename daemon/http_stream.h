#pragma once

// For http_server.cc and http_writer.cc alone: what of Asio and Beast both name.

#include <utility>  // Boost 1.74's awaitable.hpp needs it before

#include <boost/asio/awaitable.hpp>
#include <boost/asio/generic/stream_protocol.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/redirect_error.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/use_awaitable.hpp>
#include <boost/beast/core/basic_stream.hpp>
#include <boost/beast/http.hpp>
#include <chrono>
#include <cstddef>
#include <memory>

namespace opaline::daemon::http_detail {

namespace net = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
using boost::system::error_code;
using Generic = net::generic::stream_protocol;
using Stream = beast::basic_stream<Generic>;

inline auto into(error_code& error) { return net::redirect_error(net::use_awaitable, error); }

/// Counts while it lives.
class Counted {
 public:
  explicit Counted(std::size_t& count) : count_(count) { ++count_; }
  ~Counted() { --count_; }
  Counted(const Counted&) = delete;
  Counted& operator=(const Counted&) = delete;

 private:
  std::size_t& count_;
};

/// Interrupts a stream's reading when its time is up. Beast's own deadline would close the socket,
/// and our 408 would never arrive.
class ReadDeadline {
 public:
  ReadDeadline(Stream& stream, std::chrono::seconds after)
      : state_(std::make_shared<State>(State{&stream})), timer_(stream.get_executor(), after) {
    stream.expires_never();
    timer_.async_wait([state = state_](error_code error) {
      if (error || state->stream == nullptr) return;
      state->has_passed = true;
      state->stream->cancel();
    });
  }
  ~ReadDeadline() { state_->stream = nullptr; }
  ReadDeadline(const ReadDeadline&) = delete;
  ReadDeadline& operator=(const ReadDeadline&) = delete;
  bool has_passed() const { return state_->has_passed; }

 private:
  struct State {
    Stream* stream;  // null once nobody waits any more
    bool has_passed = false;
  };
  std::shared_ptr<State> state_;
  net::steady_timer timer_;
};

}  // namespace opaline::daemon::http_detail
