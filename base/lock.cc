#include "base/lock.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>

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

constexpr int kOpen = O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK;

// Every user may lock the file that one of them made, whatever his umask: in /run/lock, where all
// may write, the station is all of theirs. There the kernel lets nobody open another user's file
// with O_CREAT, so it is made only where there is none.
Result<FileDescriptor> open_to_lock(const std::filesystem::path& path) {
  for (;;) {
    FileDescriptor fd(::open(path.c_str(), kOpen | O_RDWR));
    if (fd) return fd;
    if (errno != ENOENT) return lock_error(path, errno);
    fd = FileDescriptor(::open(path.c_str(), kOpen | O_RDWR | O_CREAT | O_EXCL, 0666));
    if (fd && ::fchmod(fd.get(), 0666) != 0) return lock_error(path, errno);
    if (fd) return fd;
    if (errno != EEXIST) return lock_error(path, errno);  // else somebody was quicker
  }
}

}  // namespace

Result<FileLock> FileLock::acquire(const std::filesystem::path& path) {
  Result<FileDescriptor> fd = open_to_lock(path);
  if (!fd) return fd.error();
  struct flock range = whole_file();
  if (::fcntl(fd->get(), F_OFD_SETLK, &range) != 0) {
    if (errno == EAGAIN || errno == EACCES) {
      return busy(fmt::format("{} is held by another process", path.string()));
    }
    return lock_error(path, errno);
  }
  return FileLock(*std::move(fd));
}

Result<bool> FileLock::is_held(const std::filesystem::path& path) {
  const FileDescriptor fd(::open(path.c_str(), kOpen | O_RDONLY));
  if (!fd) {
    if (errno == ENOENT) return false;
    return lock_error(path, errno);
  }
  struct flock range = whole_file();
  if (::fcntl(fd.get(), F_OFD_GETLK, &range) != 0) return lock_error(path, errno);
  return range.l_type != F_UNLCK;
}

}  // namespace opaline
