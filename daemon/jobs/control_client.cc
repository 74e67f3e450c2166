#include "daemon/jobs/control_client.h"

#include <poll.h>
#include <sys/socket.h>

#include <cerrno>
#include <string>

#include "base/unix_socket.h"
#include "daemon/json_text.h"

namespace opaline::daemon {
namespace {

using SteadyClock = std::chrono::steady_clock;

constexpr std::size_t kAnswerLimit = 64u << 10;

bool wait_readable(int fd, SteadyClock::time_point until) {
  const auto left =
      std::chrono::duration_cast<std::chrono::milliseconds>(until - SteadyClock::now());
  pollfd ready{fd, POLLIN, 0};
  return left.count() > 0 && ::poll(&ready, 1, static_cast<int>(left.count())) > 0;
}

Result<std::string> read_line(int fd, SteadyClock::time_point until) {
  std::string line;
  while (line.size() < kAnswerLimit) {
    if (!wait_readable(fd, until)) return timeout("the job did not answer in time");
    char buffer[1024];
    const ssize_t n = ::recv(fd, buffer, sizeof buffer, MSG_DONTWAIT);
    if (n < 0 && (errno == EINTR || errno == EAGAIN)) continue;
    if (n <= 0) return unavailable("the job closed its control socket");
    line.append(buffer, static_cast<std::size_t>(n));
    if (line.ends_with('\n')) return line;
  }
  return internal_error("the job's answer is too long");
}

ErrorCode code_named(const std::string& name) {
  for (const ErrorCode code : {ErrorCode::kInvalidArgument,
                               ErrorCode::kNotFound,
                               ErrorCode::kBusy,
                               ErrorCode::kTimeout,
                               ErrorCode::kCancelled,
                               ErrorCode::kUnavailable}) {
    if (to_string(code) == name) return code;
  }
  return ErrorCode::kInternal;
}

Result<nlohmann::json> checked(const std::string& line) {
  auto answer = nlohmann::json::parse(line, nullptr, false);
  if (!answer.is_object()) return internal_error("the job's answer is no JSON object");
  if (answer.contains("ok") && answer["ok"] == true) return answer;
  const nlohmann::json error = answer.contains("error") ? answer["error"] : nlohmann::json();
  const std::string message = text_of(error, "message");
  return Error{code_named(text_of(error, "code")), message.empty() ? "the job refused" : message};
}

}  // namespace

Result<nlohmann::json> ask_job(const std::filesystem::path& socket,
                               const nlohmann::json& request,
                               std::chrono::milliseconds deadline) {
  const auto until = SteadyClock::now() + deadline;
  const Result<FileDescriptor> fd = connect_unix(socket, deadline);
  if (!fd) return fd.error();
  const std::string line = request.dump() + "\n";
  if (::send(fd->get(), line.data(), line.size(), MSG_NOSIGNAL | MSG_DONTWAIT) !=
      static_cast<ssize_t>(line.size())) {
    return unavailable("the job does not take the request");
  }
  const Result<std::string> answer = read_line(fd->get(), until);
  if (!answer) return answer.error();
  return checked(*answer);
}

}  // namespace opaline::daemon
