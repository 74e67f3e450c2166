#include "sim/rig_server.h"

#include <fmt/format.h>
#include <poll.h>
#include <sys/socket.h>

#include <algorithm>
#include <cerrno>
#include <functional>
#include <map>
#include <string>
#include <system_error>
#include <utility>

#include "base/log.h"
#include "base/unix_socket.h"
#include "sim/rig_codec.h"
#include "sim/rig_header.h"

namespace opaline::sim {
namespace {

using namespace std::chrono_literals;

constexpr std::size_t kConnections = 32;
constexpr auto kPause = 100ms;
constexpr std::chrono::seconds kRequestPatience{
    5};  ///< for a client to send or take a whole message

/// Requests a stop when the peer of a socket hangs up, or when an outer stop is requested.
class HangUpWatch {
 public:
  HangUpWatch(int socket, std::stop_token outer)
      : forward_(std::move(outer), [this] { gone_.request_stop(); }),
        thread_([this, socket](std::stop_token done) {
          const auto hung_up = wait_for(socket, POLLRDHUP, Deadline::max(), std::move(done));
          if (hung_up) gone_.request_stop();
        }) {}
  std::stop_token token() const { return gone_.get_token(); }

 private:
  std::stop_source gone_;
  std::stop_callback<std::function<void()>> forward_;
  std::jthread thread_;  // last: joins first
};

RigMessage reply_to(const Result<void>& done) { return done ? RigMessage{} : encode(done.error()); }

template <class T>
RigMessage reply_to(const Result<T>& value) {
  return value ? encode(*value) : encode(value.error());
}

RigMessage show(RigPort& rig,
                std::uint64_t session,
                const RigMessage& request,
                const std::stop_token& stop) {
  const auto pattern = decode_pattern(request);
  return pattern ? reply_to(rig.show(session, *pattern, stop)) : encode(pattern.error());
}

RigMessage arm(RigPort& rig, const RigMessage& request, bool anew) {
  const auto faults = decode_faults(request);
  if (!faults) return encode(faults.error());
  return reply_to(anew ? rig.arm(*faults) : rig.add(*faults));
}

/// Does what a request asks for.
RigMessage perform(RigPort& rig, const RigMessage& request, const std::stop_token& stop) {
  RigHeader header(request.header);
  const std::string what = header.text("do");
  const auto session = request.header.contains("session") ? header.whole<std::uint64_t>("session")
                                                          : RigPort::kAnybody;
  const std::chrono::nanoseconds exposure =
      what == "expose" ? header.time("exposure_ns") : std::chrono::nanoseconds(0);
  if (auto good = header.result(); !good) return encode(good.error());
  if (what == "open_camera") return reply_to(rig.open_camera());
  if (what == "open_projector") return reply_to(rig.open_projector());
  if (what == "expose") return reply_to(rig.expose(session, exposure, stop));
  if (what == "show") return show(rig, session, request, stop);
  if (what == "close_camera") return rig.close_camera(session), RigMessage{};
  if (what == "close_projector") return rig.close_projector(session), RigMessage{};
  if (what == "dark") return reply_to(rig.dark(session));
  if (what == "status") return reply_to(rig.status());
  if (what == "truth") return reply_to(rig.truth());
  if (what == "arm") return arm(rig, request, true);
  if (what == "add_faults") return arm(rig, request, false);
  return encode(invalid_argument(fmt::format("no request \"{}\"", what)));
}

Deadline soon() { return std::chrono::steady_clock::now() + kRequestPatience; }

}  // namespace

Result<std::unique_ptr<RigServer>> RigServer::create(RigPort& rig,
                                                     const std::filesystem::path& socket) {
  std::filesystem::path lock_path = socket;
  lock_path += ".lock";
  auto lock = FileLock::acquire(lock_path);
  if (!lock) return lock.error().in(fmt::format("serve a rig at {}", socket.string()));
  auto listener = listen_unix(socket);
  if (!listener) return listener.error();
  return std::unique_ptr<RigServer>(
      new RigServer(rig, socket, *std::move(lock), *std::move(listener)));
}

RigServer::~RigServer() {
  connections_.clear();
  std::error_code ignored;
  std::filesystem::remove(socket_, ignored);
}

Result<void> RigServer::serve(std::chrono::nanoseconds idle, std::stop_token stop) {
  while (!ending_ && !idle_for(idle)) {
    const auto ready =
        wait_for(listener_.get(), POLLIN, std::chrono::steady_clock::now() + 500ms, stop);
    if (ready) accept_one(stop);
    if (!ready && ready.error().code == ErrorCode::kCancelled) break;
    if (!ready && ready.error().code != ErrorCode::kTimeout) return ready.error();
    connections_.remove_if([](const Connection& connection) { return connection.over.load(); });
  }
  connections_.clear();
  return ok();
}

void RigServer::accept_one(const std::stop_token& stop) {
  FileDescriptor socket(::accept4(listener_.get(), nullptr, nullptr, SOCK_CLOEXEC));
  if (!socket && (errno == EMFILE || errno == ENFILE || errno == ENOMEM)) {
    log::warning("simulated rig: cannot accept a client: {}",
                 std::generic_category().message(errno));
    // The client stays in the queue: without a pause we would ask for it again at once, for ever.
    const auto paused = wait_for(-1, 0, std::chrono::steady_clock::now() + kPause, stop);
    if (!paused) return;
  }
  if (!socket) return;
  last_request_ = std::chrono::steady_clock::now();
  if (connections_.size() >= kConnections) {
    log::warning("simulated rig: {} clients at once, one refused", connections_.size());
    return;
  }
  Connection& connection = connections_.emplace_back();
  try {
    connection.thread =
        std::jthread([this, &connection, socket = std::move(socket)](std::stop_token ending) {
          answer(socket.get(), std::move(ending));
          connection.over = true;
        });
  } catch (const std::system_error& failure) {  // no more threads
    log::warning("simulated rig: {}, a client refused", failure.what());
    connections_.pop_back();
  }
}

/// A connection's outermost function.
void RigServer::answer(int connection, std::stop_token stop) noexcept {
  try {
    const auto answered = exchange(connection, stop);
    if (!answered) log::debug("simulated rig: {}", answered.error().message);
  } catch (const std::exception& failure) {
    log::error("simulated rig: a request failed: {}", failure.what());
  }
}

Result<void> RigServer::exchange(int connection, const std::stop_token& stop) {
  const auto request = receive_message(connection, soon(), stop);
  if (!request) return request.error();
  const RigMessage reply = [&] {
    const HangUpWatch watch(connection, stop);
    return respond(*request, watch.token());
  }();
  auto sent = send_message(connection, reply, soon(), stop);
  if (sent || sent.error().code != ErrorCode::kInvalidArgument) return sent;
  return send_message(connection, encode(sent.error().in("reply")), soon(), stop);  // too large
}

RigMessage RigServer::respond(const RigMessage& request, const std::stop_token& stop) {
  if (RigHeader(request.header).find("do") != "end") return perform(rig_, request, stop);
  ending_ = true;
  return reply_to(rig_.dark(RigPort::kAnybody));
}

bool RigServer::idle_for(std::chrono::nanoseconds idle) {
  if (!connections_.empty() || std::chrono::steady_clock::now() - last_request_ < idle)
    return false;
  const auto status = rig_.status();
  return status && !status->lamp_on;
}

}  // namespace opaline::sim
