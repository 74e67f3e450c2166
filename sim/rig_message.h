#pragma once

#include <chrono>
#include <cstddef>
#include <nlohmann/json.hpp>
#include <stop_token>
#include <vector>

#include "base/result.h"

namespace opaline::sim {

/// What goes over the rig's socket, one request and one reply a connection:
///
///   u32 header bytes, u32 payload bytes (little endian), header (JSON object), payload (samples, little endian)
///
/// Limits: header 64 KiB, payload 256 MiB; a peer that claims more is not listened to.
struct RigMessage {
  nlohmann::json header = nlohmann::json::object();
  std::vector<std::byte> payload;
};

using Deadline = std::chrono::steady_clock::time_point;

/// Both make the socket non-blocking. Errors: kTimeout at the deadline, kCancelled soon after a stop request,
/// kUnavailable when the peer hangs up, kInvalidArgument for what is not a message.
Result<void> send_message(int socket,
                          const RigMessage& message,
                          Deadline deadline,
                          std::stop_token stop);
Result<RigMessage> receive_message(int socket, Deadline deadline, std::stop_token stop);

/// Waits until a descriptor is ready for some of poll(2)'s events, which it returns.
Result<short> wait_for(int descriptor, short events, Deadline deadline, std::stop_token stop);

}  // namespace opaline::sim
