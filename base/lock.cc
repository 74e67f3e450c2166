#include "base/lock.h"

#include <fcntl.h>
#include <fmt/format.h>

#include <cerrno>
#include <system_error>

namespace opaline {
namespace {

struct flock whole_file() {
  struct flock range {};
  range.l_type = F_WRLCK;
  range.l_whence = SEEK_SET;
  return range;
}

Error lock_error(const std::filesystem::path& path, int code) {
  return unavailable(
      fmt::format("cannot lock {}: {}", path.string(), std::generic_category().message(code)));
}

}  // namespace

Result<FileLock> FileLock::acquire(const std::filesystem::path& path) {
  FileDescriptor fd(::open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0644));
  if (!fd) return lock_error(path, errno);
  struct flock range = whole_file();
  if (::fcntl(fd.get(), F_OFD_SETLK, &range) != 0) {
    if (errno == EAGAIN || errno == EACCES) {
      return busy(fmt::format("{} is held by another process", path.string()));
    }
    return lock_error(path, errno);
  }
  return FileLock(std::move(fd));
}

Result<bool> FileLock::is_held(const std::filesystem::path& path) {
  const FileDescriptor fd(::open(path.c_str(), O_RDWR | O_CLOEXEC));
  if (!fd) {
    if (errno == ENOENT) return false;
    return lock_error(path, errno);
  }
  struct flock range = whole_file();
  if (::fcntl(fd.get(), F_OFD_GETLK, &range) != 0) return lock_error(path, errno);
  return range.l_type != F_UNLCK;
}

}  // namespace opaline
