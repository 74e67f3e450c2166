#include "sim/rig_message.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <system_error>

#include "base/file_descriptor.h"

namespace opaline::sim {
namespace {

constexpr std::uint32_t kHeaderLimit = 64u << 10;
constexpr std::uint32_t kPayloadLimit = 256u << 20;
constexpr std::size_t kPayloadStep = 1u << 20;  // what is claimed costs memory as it arrives
constexpr std::size_t kPrefixBytes = 8;

Error last_error(std::string_view doing) {
  const int code = errno;
  return unavailable(fmt::format("cannot {}: {}", doing, std::generic_category().message(code)));
}

int milliseconds_until(Deadline deadline) {
  const auto left =
      std::chrono::ceil<std::chrono::milliseconds>(deadline - std::chrono::steady_clock::now());
  return static_cast<int>(std::clamp<std::chrono::milliseconds::rep>(left.count(), 0, 3'600'000));
}

/// A descriptor that becomes readable when a stop is requested.
class StopEvent {
 public:
  explicit StopEvent(std::stop_token stop)
      : event_(::eventfd(0, EFD_CLOEXEC)),
        callback_(std::move(stop), [this] { ::eventfd_write(event_.get(), 1); }) {}
  int descriptor() const { return event_.get(); }

 private:
  FileDescriptor event_;
  std::stop_callback<std::function<void()>> callback_;
};

Result<void> set_non_blocking(int socket) {
  const int flags = ::fcntl(socket, F_GETFL);
  if (flags < 0 || ::fcntl(socket, F_SETFL, flags | O_NONBLOCK) != 0)
    return last_error("use socket");
  return ok();
}

/// Moves all bytes by `step`, a send or recv of what is left.
template <class Bytes, class Step>
Result<void> move_all(int socket,
                      short direction,
                      Bytes bytes,
                      Deadline deadline,
                      const std::stop_token& stop,
                      Step step) {
  while (!bytes.empty()) {
    const ssize_t moved = step(bytes);
    if (moved > 0) {
      bytes = bytes.subspan(static_cast<std::size_t>(moved));
      continue;
    }
    if (moved == 0) return unavailable("the peer hung up");
    if (errno == EINTR) continue;
    if (errno != EAGAIN && errno != EWOULDBLOCK) return last_error("exchange bytes");
    if (auto ready = wait_for(socket, direction, deadline, stop); !ready) return ready.error();
  }
  return ok();
}

Result<void> send_all(int socket,
                      std::span<const std::byte> bytes,
                      Deadline deadline,
                      const std::stop_token& stop) {
  return move_all(socket, POLLOUT, bytes, deadline, stop, [&](std::span<const std::byte> rest) {
    return ::send(socket, rest.data(), rest.size(), MSG_NOSIGNAL);
  });
}

Result<void> receive_all(int socket,
                         std::span<std::byte> bytes,
                         Deadline deadline,
                         const std::stop_token& stop) {
  return move_all(socket, POLLIN, bytes, deadline, stop, [&](std::span<std::byte> rest) {
    return ::recv(socket, rest.data(), rest.size(), 0);
  });
}

void put(std::span<std::byte> bytes, std::size_t value) {
  for (std::byte& byte : bytes) {
    byte = static_cast<std::byte>(value & 255);
    value >>= 8;
  }
}

std::uint32_t get(std::span<const std::byte> bytes) {
  std::uint32_t value = 0;
  for (std::size_t i = bytes.size(); i > 0; --i) {
    value = value << 8 | std::to_integer<std::uint32_t>(bytes[i - 1]);
  }
  return value;
}

}  // namespace

Result<short> wait_for(int descriptor, short events, Deadline deadline, std::stop_token stop) {
  const StopEvent stopping(stop);
  for (;;) {
    std::array<pollfd, 2> waiting{pollfd{descriptor, events, 0},
                                  pollfd{stopping.descriptor(), POLLIN, 0}};
    const int ready = ::poll(waiting.data(), waiting.size(), milliseconds_until(deadline));
    if (ready < 0 && errno != EINTR) return last_error("wait for socket");
    if (stop.stop_requested()) return cancelled("stopped");
    if (ready > 0 && waiting[0].revents != 0) return waiting[0].revents;
    if (std::chrono::steady_clock::now() >= deadline) return timeout("no answer in time");
  }
}

Result<void> send_message(int socket,
                          const RigMessage& message,
                          Deadline deadline,
                          std::stop_token stop) {
  const std::string header = message.header.dump();
  if (header.size() > kHeaderLimit || message.payload.size() > kPayloadLimit) {
    return invalid_argument(fmt::format("message of {} + {} bytes; expected at most {} + {}",
                                        header.size(),
                                        message.payload.size(),
                                        kHeaderLimit,
                                        kPayloadLimit));
  }
  if (auto done = set_non_blocking(socket); !done) return done;
  std::vector<std::byte> head(kPrefixBytes);
  put(std::span(head).first(4), header.size());
  put(std::span(head).subspan(4), message.payload.size());
  const auto text = std::as_bytes(std::span(header));
  head.insert(head.end(), text.begin(), text.end());
  if (auto sent = send_all(socket, head, deadline, stop); !sent) return sent;
  return send_all(socket, message.payload, deadline, stop);
}

Result<RigMessage> receive_message(int socket, Deadline deadline, std::stop_token stop) {
  if (auto done = set_non_blocking(socket); !done) return done.error();
  std::array<std::byte, kPrefixBytes> prefix{};
  if (auto got = receive_all(socket, prefix, deadline, stop); !got) return got.error();
  const std::uint32_t header_bytes = get(std::span(prefix).first(4));
  const std::uint32_t payload_bytes = get(std::span(prefix).subspan(4));
  if (header_bytes > kHeaderLimit || payload_bytes > kPayloadLimit) {
    return invalid_argument(
        fmt::format("not a message: {} + {} bytes", header_bytes, payload_bytes));
  }
  std::string header(header_bytes, '\0');
  if (auto got = receive_all(socket, std::as_writable_bytes(std::span(header)), deadline, stop);
      !got) {
    return got.error();
  }
  RigMessage message{nlohmann::json::parse(header, nullptr, false), {}};
  if (!message.header.is_object()) return invalid_argument("not a message: no JSON object");
  while (message.payload.size() < payload_bytes) {
    const std::size_t had = message.payload.size();
    message.payload.resize(std::min<std::size_t>(payload_bytes, had + kPayloadStep));
    const auto space = std::span(message.payload).subspan(had);
    if (auto got = receive_all(socket, space, deadline, stop); !got) return got.error();
  }
  return message;
}

}  // namespace opaline::sim
