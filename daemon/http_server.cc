#include "daemon/http_server.h"

#include <fcntl.h>
#include <fmt/ranges.h>

#include <utility>  // Boost 1.74's awaitable.hpp needs it before

#include <algorithm>
#include <boost/asio/co_spawn.hpp>
#include <boost/asio/detached.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/local/stream_protocol.hpp>
#include <boost/asio/signal_set.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <csignal>
#include <exception>

#include "base/log.h"
#include "base/unix_socket.h"
#include "daemon/http_access.h"
#include "daemon/http_writer.h"
#include "daemon/problem.h"
#include "daemon/router.h"

namespace opaline::daemon {
namespace {

using namespace http_detail;  // NOLINT(google-build-using-namespace)
using Tcp = net::ip::tcp;
using Local = net::local::stream_protocol;

constexpr std::uint32_t kHeaderLimit = 8u << 10;
constexpr std::uint64_t kBodyLimit = 1u << 20;
constexpr std::size_t kOwnConnections = 8;  // of the Unix socket alone
constexpr std::chrono::milliseconds kFullPause{20};

// Asio of Boost 1.74 does not: a program that is started elsewhere would keep our port.
template <class Socket>
void close_on_exec(Socket& socket) {
  ::fcntl(socket.native_handle(), F_SETFD, FD_CLOEXEC);
}

std::string lower(std::string_view text) {
  std::string result(text);
  for (char& c : result) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return result;
}

std::string_view view(boost::string_view text) { return {text.data(), text.size()}; }

// Nothing when the target is no path.
std::optional<HttpRequest> plain(const http::request<http::string_body>& from, bool same_user) {
  HttpRequest request;
  const std::string_view target = view(from.target());
  const std::size_t mark = target.find('?');
  auto path = split_path(target.substr(0, mark));
  if (!path) return std::nullopt;
  request.path = *std::move(path);
  if (mark != std::string_view::npos) request.query = split_query(target.substr(mark + 1));
  request.method = std::string(view(from.method_string()));
  for (const auto& field : from) {
    request.headers[lower(view(field.name_string()))] = std::string(view(field.value()));
  }
  request.body = from.body();
  request.same_user = same_user;
  return request;
}

HttpResponse response_to(error_code error) {
  if (error == http::error::body_limit) {
    return problem(413, "too_large", "a body has at most 1 MiB");
  }
  if (error == http::error::header_limit || error == http::error::buffer_overflow) {
    return problem(431, "too_large", "a header has at most 8 KiB");
  }
  if (error == beast::error::timeout) {
    return problem(408, "timeout", "the request did not come in time");
  }
  return problem(400, "invalid_argument", "not an HTTP/1.1 request: " + error.message());
}

// Whether anybody is there to be told.
bool is_gone(error_code error) {
  return error == http::error::end_of_stream || error == net::error::eof ||
         error == net::error::connection_reset || error == net::error::operation_aborted;
}

}  // namespace

struct HttpServer::Impl {
  Impl(Options given, Handler given_handler)
      : options(std::move(given)), handler(std::move(given_handler)) {}

  Result<void> listen_tcp();
  Result<void> listen_local();
  template <class Acceptor>
  net::awaitable<void> accept_from(Acceptor& acceptor, bool same_user);
  net::awaitable<void> serve(Stream stream, bool same_user);
  net::awaitable<bool> serve_one(Stream& stream, beast::flat_buffer& buffer, bool same_user);
  HttpResponse handle(const http::request<http::string_body>& message, bool same_user);
  HttpResponse call_handler(const HttpRequest& request);

  Options options;
  Handler handler;
  std::size_t connections = 0;
  HttpWriter writer{options.write_deadline};
  net::io_context context{1};  // destroys the connections, which count themselves above
  Tcp::acceptor tcp{context};
  Local::acceptor local{context};
};

Result<void> HttpServer::Impl::listen_tcp() {
  error_code error;
  const auto address = net::ip::make_address(options.address, error);
  if (error) return invalid_argument("\"" + options.address + "\" is not an IP address");
  if (!address.is_loopback() && options.token.empty()) {
    return invalid_argument(options.address +
                            " is open to others: give a token file, or listen on 127.0.0.1");
  }
  const Tcp::endpoint endpoint(address, options.port);
  tcp.open(endpoint.protocol(), error);
  if (!error) close_on_exec(tcp);
  if (!error) tcp.set_option(Tcp::acceptor::reuse_address(true), error);
  if (!error) tcp.bind(endpoint, error);
  if (!error) tcp.listen(net::socket_base::max_listen_connections, error);
  const std::string where = fmt::format("{}:{}", options.address, options.port);
  if (error == net::error::address_in_use) return busy(where + " is in use by another program");
  if (error) return unavailable(where + ": " + error.message());
  return ok();
}

Result<void> HttpServer::Impl::listen_local() {
  const auto other = connect_unix(options.socket);
  if (other || other.error().code == ErrorCode::kTimeout) {
    return busy(options.socket.string() + " is served by another opalined");
  }
  Result<FileDescriptor> fd = listen_unix(options.socket);
  if (!fd) return fd.error();
  error_code error;
  local.assign(Local(), fd->get(), error);
  if (error) return unavailable(options.socket.string() + ": " + error.message());
  fd->release();
  return ok();
}

template <class Acceptor>
net::awaitable<void> HttpServer::Impl::accept_from(Acceptor& acceptor, bool same_user) {
  const std::size_t own = std::min(kOwnConnections, options.max_connections / 2);
  const std::size_t limit = options.max_connections - (same_user ? 0 : own);
  net::steady_timer full(context);
  for (;;) {
    error_code error;
    while (connections >= limit) {  // those who come wait in the kernel's queue
      full.expires_after(kFullPause);
      co_await full.async_wait(into(error));
    }
    typename Acceptor::protocol_type::socket socket(context);
    co_await acceptor.async_accept(socket, into(error));
    if (error == net::error::operation_aborted) co_return;
    if (error) {  // out of descriptors, perhaps: give the connections time to end
      log::warning("accept: {}", error.message());
      net::steady_timer pause(context, std::chrono::seconds(1));
      co_await pause.async_wait(into(error));
      continue;
    }
    close_on_exec(socket);
    Stream stream{Generic::socket(std::move(socket))};
    net::co_spawn(context, serve(std::move(stream), same_user), net::detached);
  }
}

net::awaitable<void> HttpServer::Impl::serve(Stream stream, bool same_user) {
  const Counted counted(connections);
  try {
    beast::flat_buffer buffer;
    while (co_await serve_one(stream, buffer, same_user)) {
    }
    co_await writer.linger(stream);
  } catch (const std::exception& e) {
    log::error("connection: {}", e.what());
  }
}

// False when the connection should end.
net::awaitable<bool> HttpServer::Impl::serve_one(Stream& stream,
                                                 beast::flat_buffer& buffer,
                                                 bool same_user) {
  http::request_parser<http::string_body> parser;
  parser.header_limit(kHeaderLimit);
  parser.body_limit(kBodyLimit);
  error_code error;
  {
    const ReadDeadline deadline(stream, options.read_deadline);
    co_await http::async_read(stream, buffer, parser, into(error));
    if (error && deadline.has_passed()) error = beast::error::timeout;
  }
  if (is_gone(error)) co_return false;
  if (error == beast::error::timeout && !parser.got_some()) co_return false;
  HttpResponse response = error ? response_to(error) : handle(parser.get(), same_user);
  const bool keep_alive = !error && parser.get().keep_alive() && response.stream == nullptr;
  if (!error && parser.get().method() == http::verb::head) {
    co_await writer.write_head(stream, response, keep_alive);
  } else {
    co_await writer.write(stream, response, keep_alive);
  }
  co_return keep_alive;
}

HttpResponse HttpServer::Impl::handle(const http::request<http::string_body>& message,
                                      bool same_user) {
  const std::optional<HttpRequest> request = plain(message, same_user);
  if (!request) return problem(400, "invalid_argument", "the target is not a path");
  if (std::optional<HttpResponse> refusal = refuse(*request, options.token)) {
    return *std::move(refusal);
  }
  HttpResponse response = call_handler(*request);
  if (response.stream != nullptr && writer.streams() >= options.max_streams) {
    return problem(503, "busy", "too many event streams");
  }
  return response;
}

// A handler's exception is our fault, and no reason to leave the client without an answer.
HttpResponse HttpServer::Impl::call_handler(const HttpRequest& request) {
  try {
    return handler(request);
  } catch (const std::exception& e) {
    log::error("{} /{}: {}", request.method, fmt::join(request.path, "/"), e.what());
    return problem(500, "internal", "the daemon failed at this request; its log says more");
  }
}

Result<std::unique_ptr<HttpServer>> HttpServer::listen(const Options& options, Handler handler) {
  auto impl = std::make_unique<Impl>(options, std::move(handler));
  if (!options.address.empty()) {
    if (auto listening = impl->listen_tcp(); !listening) return listening.error();
  }
  if (!options.socket.empty()) {
    if (auto listening = impl->listen_local(); !listening) return listening.error();
  }
  return std::unique_ptr<HttpServer>(new HttpServer(std::move(impl)));
}

HttpServer::HttpServer(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}

HttpServer::~HttpServer() {
  if (impl_->options.socket.empty()) return;
  std::error_code ignored;
  std::filesystem::remove(impl_->options.socket, ignored);
}

std::uint16_t HttpServer::port() const {
  error_code error;
  const Tcp::endpoint endpoint = impl_->tcp.local_endpoint(error);
  return error ? std::uint16_t{0} : endpoint.port();
}

void HttpServer::run() {
  net::signal_set signals(impl_->context, SIGTERM, SIGINT);
  signals.async_wait([this](const error_code& error, int) {
    if (!error) stop();
  });
  if (impl_->tcp.is_open()) {
    net::co_spawn(impl_->context, impl_->accept_from(impl_->tcp, false), net::detached);
  }
  if (impl_->local.is_open()) {
    net::co_spawn(impl_->context, impl_->accept_from(impl_->local, true), net::detached);
  }
  impl_->context.run();
}

void HttpServer::stop() { impl_->context.stop(); }

}  // namespace opaline::daemon
