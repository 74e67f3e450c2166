#include "base/unix_socket.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <cerrno>
#include <system_error>

#include "base/clock.h"

namespace opaline {
namespace {

constexpr int kBacklog = 8;
constexpr std::chrono::milliseconds kRetryEvery{10};

Error socket_error(std::string_view doing, const std::filesystem::path& path) {
  const int code = errno;
  return unavailable(
      fmt::format("cannot {} {}: {}", doing, path.string(), std::generic_category().message(code)));
}

/// A socket's address by way of its opened directory, which must stay open while it is used.
struct ShortAddress {
  FileDescriptor directory;
  sockaddr_un address{};
};

Result<ShortAddress> short_address(const std::filesystem::path& path) {
  const std::filesystem::path parent = path.has_parent_path() ? path.parent_path() : ".";
  ShortAddress result{FileDescriptor(::open(parent.c_str(), O_PATH | O_DIRECTORY | O_CLOEXEC)), {}};
  if (!result.directory) return socket_error("open", parent);
  const std::string name =
      fmt::format("/proc/self/fd/{}/{}", result.directory.get(), path.filename().string());
  if (name.size() >= sizeof(result.address.sun_path)) {
    return invalid_argument(fmt::format("{} is too long a name for a socket", path.string()));
  }
  result.address.sun_family = AF_UNIX;
  name.copy(static_cast<char*>(result.address.sun_path), name.size());
  return result;
}

const sockaddr* generic(const sockaddr_un& address) {
  return reinterpret_cast<const sockaddr*>(&address);
}

// Removes an old socket; `name` is what to call `path` by.
Result<void> make_room(const char* name, const std::filesystem::path& path) {
  struct stat status {};
  if (::lstat(name, &status) != 0) {
    return errno == ENOENT ? ok() : Result<void>(socket_error("look at", path));
  }
  if (!S_ISSOCK(status.st_mode)) {
    return invalid_argument(
        fmt::format("{} is there already and is no socket: move it away, or choose another path",
                    path.string()));
  }
  return ::unlink(name) == 0 ? ok() : Result<void>(socket_error("remove", path));
}

}  // namespace

Result<FileDescriptor> listen_unix(const std::filesystem::path& path) {
  const Result<ShortAddress> target = short_address(path);
  if (!target) return target.error();
  FileDescriptor fd(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  if (!fd) return socket_error("create", path);
  const char* name = static_cast<const char*>(target->address.sun_path);
  if (auto free = make_room(name, path); !free) return free.error();
  if (::bind(fd.get(), generic(target->address), sizeof(sockaddr_un)) != 0) {
    return socket_error("bind", path);
  }
  // Nobody can connect before listen(), so the permissions are narrow from the start.
  if (::chmod(name, S_IRUSR | S_IWUSR) != 0 || ::listen(fd.get(), kBacklog) != 0) {
    return socket_error("listen at", path);
  }
  return fd;
}

Result<FileDescriptor> connect_unix(const std::filesystem::path& path,
                                    std::chrono::nanoseconds patience,
                                    std::stop_token stop) {
  const Result<ShortAddress> target = short_address(path);
  if (!target) return target.error();
  FileDescriptor fd(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  if (!fd) return socket_error("create", path);
  SystemClock clock;
  const std::chrono::nanoseconds deadline = clock.now() + patience;
  while (::connect(fd.get(), generic(target->address), sizeof(sockaddr_un)) != 0) {
    if (errno != EAGAIN) return socket_error("connect to", path);  // EAGAIN: the backlog is full
    if (clock.now() >= deadline) {
      return timeout(fmt::format("{} takes no connection: whoever serves it is stopped or hangs",
                                 path.string()));
    }
    if (!clock.sleep(kRetryEvery, stop)) return cancelled("while connecting to " + path.string());
  }
  if (::fcntl(fd.get(), F_SETFL, 0) != 0) return socket_error("connect to", path);
  return fd;
}

}  // namespace opaline
