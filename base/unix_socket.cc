#include "base/unix_socket.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <cerrno>
#include <system_error>

namespace opaline {
namespace {

constexpr int kBacklog = 8;

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

}  // namespace

Result<FileDescriptor> listen_unix(const std::filesystem::path& path) {
  const Result<ShortAddress> target = short_address(path);
  if (!target) return target.error();
  FileDescriptor fd(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  if (!fd) return socket_error("create", path);
  const char* name = static_cast<const char*>(target->address.sun_path);
  ::unlink(name);
  if (::bind(fd.get(), generic(target->address), sizeof(sockaddr_un)) != 0) {
    return socket_error("bind", path);
  }
  // Nobody can connect before listen(), so the permissions are narrow from the start.
  if (::chmod(name, S_IRUSR | S_IWUSR) != 0 || ::listen(fd.get(), kBacklog) != 0) {
    return socket_error("listen at", path);
  }
  return fd;
}

Result<FileDescriptor> connect_unix(const std::filesystem::path& path) {
  const Result<ShortAddress> target = short_address(path);
  if (!target) return target.error();
  FileDescriptor fd(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0));
  if (!fd) return socket_error("create", path);
  if (::connect(fd.get(), generic(target->address), sizeof(sockaddr_un)) != 0) {
    return socket_error("connect to", path);
  }
  return fd;
}

}  // namespace opaline
