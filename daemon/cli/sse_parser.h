#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>

namespace opaline::daemon {

/// One message of a stream of Server-Sent Events.
struct ServerEvent {
  std::optional<std::uint64_t> id;
  std::string type;
  std::string data;
};

/// Cuts a text/event-stream, which comes in arbitrary pieces, into its messages.
class SseParser {
 public:
  explicit SseParser(std::function<void(const ServerEvent&)> on_event)
      : on_event_(std::move(on_event)) {}
  void feed(std::string_view piece);

 private:
  void take_line(std::string_view line);

  std::function<void(const ServerEvent&)> on_event_;
  std::string received_;
  ServerEvent event_;
};

}  // namespace opaline::daemon
