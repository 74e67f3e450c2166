#include "daemon/live_objects.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <string_view>
#include <system_error>

#include "daemon/jobs/control_client.h"

namespace opaline::daemon {
namespace {

constexpr std::array<std::string_view, 5> kWishes{"edit", "undo", "redo", "look", "shine"};
constexpr std::size_t kLongestWish = 4000;  // of the socket's 4096

}  // namespace

Result<std::filesystem::path> LiveObjects::directory_of(const std::string& id) const {
  const Result<SessionDirectory> session = directory_(id);
  if (!session) return session.error();
  return session->preview() / "live";
}

Error LiveObjects::nothing_shown(const std::string& id) const {
  return not_found(fmt::format(
      "no object of session {} has been shown: POST /v1/sessions/{}/object starts that", id, id));
}

Result<nlohmann::json> LiveObjects::start(const std::string& id) {
  const Result<SessionDirectory> session = directory_(id);
  if (!session) return session.error();
  std::error_code none;
  if (!std::filesystem::exists(session->material(), none))
    return busy(fmt::format("session {} has no material yet", id));
  const Result<std::filesystem::path> directory = directory_of(id);
  if (!directory) return directory.error();
  if (is_live(*directory) || is_started(*directory)) return look(id);
  if (auto started = start_in(*directory,
                              {"preview",
                               *directory,
                               {"--live",
                                "--while-watched",
                                std::to_string(kWatchedFor.count()),
                                "--",
                                session->path().string()}});
      !started)
    return started.error();
  return look(id);
}

Result<void> LiveObjects::stop(const std::string& id) {
  const Result<nlohmann::json> now = look(id);
  if (!now) return now.error();
  const std::string state = now->value("state", "");
  if (state != "running" && state != "starting")
    return busy(fmt::format("no object of session {} is shown", id));
  const Result<std::filesystem::path> directory = directory_of(id);
  if (!directory) return directory.error();
  return files_.remove(*directory / "watched");
}

Result<void> LiveObjects::wish(const std::string& id, const nlohmann::json& request) {
  if (!request.is_object()) return invalid_argument("the body is not a JSON object");
  const auto command = request.find("command");
  const bool is_known = command != request.end() && command->is_string() &&
                        std::ranges::find(kWishes, command->get<std::string>()) != kWishes.end();
  if (!is_known) return invalid_argument("\"command\": expected edit, undo, redo, look or shine");
  const std::string text = request.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
  if (text.size() > kLongestWish)
    return invalid_argument(fmt::format("expected at most {} bytes", kLongestWish));
  const Result<nlohmann::json> now = look(id);
  if (!now) return now.error();
  if (now->value("state", "") != "running")
    return busy(fmt::format("no object of session {} is shown", id));
  const Result<std::filesystem::path> directory = directory_of(id);
  if (!directory) return directory.error();
  const auto answered = ask_job(*directory / "control.sock", request);
  return answered ? ok() : Result<void>(answered.error());
}

}  // namespace opaline::daemon
