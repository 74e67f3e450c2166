#include "daemon/jobs/control_server.h"

#include <poll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>

#include <cerrno>
#include <chrono>
#include <list>
#include <string>
#include <utility>
#include <vector>

#include "base/log.h"
#include "base/unix_socket.h"

namespace opaline::daemon {
namespace {

using SteadyClock = std::chrono::steady_clock;

constexpr std::size_t kLineLimit = 4096;
constexpr std::size_t kConnectionLimit = 8;
constexpr std::chrono::seconds kSilenceLimit{5};
constexpr int kLookAtDeadlinesMs = 1000;

struct Connection {
  FileDescriptor fd;
  std::string received;
  SteadyClock::time_point deadline;
};

// False when the connection should be closed; an answer that the peer does not take is one reason.
bool send_line(int fd, const nlohmann::json& answer) {
  const std::string line =
      answer.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace) + "\n";
  const ssize_t sent = ::send(fd, line.data(), line.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
  return sent == static_cast<ssize_t>(line.size());
}

nlohmann::json answer_line(const std::string& line, const ControlServer::Handler& handler) {
  const auto request = nlohmann::json::parse(line, nullptr, false);
  if (!request.is_object()) return control_error(invalid_argument("a request is one JSON object"));
  return handler(request);
}

bool answer_lines(Connection& connection, const ControlServer::Handler& handler) {
  for (std::size_t end = connection.received.find('\n'); end != std::string::npos;
       end = connection.received.find('\n')) {
    const std::string line = connection.received.substr(0, end);
    connection.received.erase(0, end + 1);
    if (!send_line(connection.fd.get(), answer_line(line, handler))) return false;
  }
  if (connection.received.size() <= kLineLimit) return true;
  send_line(connection.fd.get(), control_error(invalid_argument("a line has at most 4096 bytes")));
  return false;
}

// False when the connection is over.
bool receive(Connection& connection, const ControlServer::Handler& handler) {
  char buffer[kLineLimit];
  const ssize_t n = ::recv(connection.fd.get(), buffer, sizeof buffer, MSG_DONTWAIT);
  if (n < 0) return errno == EAGAIN || errno == EINTR;
  if (n == 0) return false;
  connection.deadline = SteadyClock::now() + kSilenceLimit;
  connection.received.append(buffer, static_cast<std::size_t>(n));
  return answer_lines(connection, handler);
}

/// The poll loop's state; lives on the server's thread.
class Connections {
 public:
  Connections(int listener, int wake, const ControlServer::Handler& handler)
      : listener_(listener), wake_(wake), handler_(handler) {}

  void serve(const std::stop_token& stop) {
    while (!stop.stop_requested()) {
      std::vector<pollfd> fds{{listener_, POLLIN, 0}, {wake_, POLLIN, 0}};
      for (const Connection& c : connections_) fds.push_back({c.fd.get(), POLLIN, 0});
      if (::poll(fds.data(), fds.size(), kLookAtDeadlinesMs) < 0 && errno != EINTR) return;
      serve_ready(fds);
      if (fds[0].revents != 0) accept_one();
    }
  }

 private:
  void serve_ready(const std::vector<pollfd>& fds) {
    std::size_t i = 2;
    const auto now = SteadyClock::now();
    for (auto it = connections_.begin(); it != connections_.end(); ++i) {
      const bool open = fds[i].revents != 0 ? receive(*it, handler_) : now < it->deadline;
      it = open ? std::next(it) : connections_.erase(it);
    }
  }

  void accept_one() {
    FileDescriptor fd(::accept4(listener_, nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK));
    if (!fd) return;
    if (connections_.size() >= kConnectionLimit) {
      send_line(fd.get(), control_error(busy("too many connections")));
      return;
    }
    connections_.push_back({std::move(fd), {}, SteadyClock::now() + kSilenceLimit});
  }

  int listener_;
  int wake_;
  const ControlServer::Handler& handler_;
  std::list<Connection> connections_;
};

}  // namespace

nlohmann::json control_error(const Error& error) {
  return {{"ok", false}, {"error", {{"code", to_string(error.code)}, {"message", error.message}}}};
}

Result<std::unique_ptr<ControlServer>> ControlServer::start(const std::filesystem::path& socket,
                                                            Handler handler) {
  Result<FileDescriptor> listener = listen_unix(socket);
  if (!listener) return listener.error();
  FileDescriptor wake(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK));
  if (!wake) return unavailable("cannot create an eventfd");
  return std::unique_ptr<ControlServer>(
      new ControlServer(socket, *std::move(listener), std::move(wake), std::move(handler)));
}

ControlServer::ControlServer(std::filesystem::path socket,
                             FileDescriptor listener,
                             FileDescriptor wake,
                             Handler handler)
    : socket_(std::move(socket)),
      listener_(std::move(listener)),
      wake_(std::move(wake)),
      handler_(std::move(handler)),
      thread_([this](const std::stop_token& stop) {
        Connections(listener_.get(), wake_.get(), handler_).serve(stop);
      }) {}

ControlServer::~ControlServer() {
  thread_.request_stop();
  const std::uint64_t one = 1;
  if (::write(wake_.get(), &one, sizeof one) < 0) log::debug("control socket: no wake-up");
  std::error_code ignored;
  std::filesystem::remove(socket_, ignored);
}

}  // namespace opaline::daemon
