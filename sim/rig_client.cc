#include "sim/rig_client.h"

#include <fmt/format.h>

#include <utility>

#include "base/log.h"
#include "base/unix_socket.h"
#include "sim/rig_codec.h"

namespace opaline::sim {

Result<RigMessage> RigClient::ask(const char* what,
                                  RigMessage request,
                                  std::chrono::nanoseconds patience,
                                  std::stop_token stop) const {
  const std::string where = fmt::format("simulated rig at {}", socket_.string());
  if (stop.stop_requested()) return cancelled(fmt::format("{}: stopped", what));
  const Deadline deadline =
      std::chrono::time_point_cast<Deadline::duration>(std::chrono::steady_clock::now() + patience);
  const auto connection = connect_unix(socket_, patience, stop);
  if (!connection) return connection.error().in(where);
  request.header["do"] = what;
  if (auto sent = send_message(connection->get(), request, deadline, stop); !sent) {
    return sent.error().in(where);
  }
  auto reply = receive_message(connection->get(), deadline, stop);
  if (!reply) return reply.error().in(where);
  if (auto good = check_reply(*reply); !good) return good.error();
  return reply;
}

Result<RigPort::Opened<drivers::CameraInfo>> RigClient::open_camera() {
  const auto reply = ask("open_camera");
  if (!reply) return reply.error();
  return decode_opened_camera(*reply);
}

Result<RigPort::Opened<drivers::ProjectorInfo>> RigClient::open_projector() {
  const auto reply = ask("open_projector");
  if (!reply) return reply.error();
  return decode_opened_projector(*reply);
}

Result<Frame> RigClient::expose(std::uint64_t session,
                                std::chrono::nanoseconds exposure,
                                std::stop_token stop) {
  RigMessage request;
  request.header["session"] = session;
  request.header["exposure_ns"] = exposure.count();
  const auto patience =
      std::max(exposure, std::chrono::nanoseconds(0)) * 3 / 2 + std::chrono::seconds(2);
  const auto reply = ask("expose", std::move(request), patience, std::move(stop));
  if (!reply) return reply.error();
  return decode_frame(*reply);
}

Result<void> RigClient::show(std::uint64_t session,
                             const drivers::Pattern& pattern,
                             std::stop_token stop) {
  RigMessage request = encode(pattern);
  request.header["session"] = session;
  const auto reply = ask("show", std::move(request), std::chrono::seconds(2), std::move(stop));
  if (!reply) return reply.error();
  return ok();
}

void RigClient::close(const char* what, std::uint64_t session) const noexcept {
  try {
    RigMessage request;
    request.header["session"] = session;
    const auto reply = ask(what, std::move(request));
    if (!reply) log::warning("{}: {}", what, reply.error().message);
  } catch (const std::exception& failure) {
    log::warning("{}: {}", what, failure.what());
  }
}

void RigClient::close_camera(std::uint64_t session) noexcept { close("close_camera", session); }

void RigClient::close_projector(std::uint64_t session) noexcept {
  close("close_projector", session);
}

Result<void> RigClient::dark(std::uint64_t session) {
  RigMessage request;
  request.header["session"] = session;
  const auto reply = ask("dark", std::move(request));
  if (!reply) return reply.error();
  return ok();
}

Result<RigStatus> RigClient::status() {
  const auto reply = ask("status");
  if (!reply) return reply.error();
  return decode_status(*reply);
}

Result<RigTruth> RigClient::truth() {
  const auto reply = ask("truth");
  if (!reply) return reply.error();
  return decode_truth(*reply);
}

Result<void> RigClient::end() {
  const auto reply = ask("end");
  if (!reply) return reply.error();
  return ok();
}

Result<void> RigClient::arm(const Faults& faults) {
  const auto reply = ask("arm", encode(faults));
  if (!reply) return reply.error();
  return ok();
}

Result<void> RigClient::add(const Faults& faults) {
  const auto reply = ask("add_faults", encode(faults));
  if (!reply) return reply.error();
  return ok();
}

}  // namespace opaline::sim
