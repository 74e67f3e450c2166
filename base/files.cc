#include "base/files.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <system_error>

#include "base/file_descriptor.h"
#include "base/log.h"

namespace opaline {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kPartial = ".partial";

Error system_error(std::string_view doing, const fs::path& path, int code) {
  std::string message =
      fmt::format("cannot {} {}: {}", doing, path.string(), std::generic_category().message(code));
  switch (code) {
    case ENOENT:
      return not_found(std::move(message));
    case ENOSPC:
    case EDQUOT:
      return unavailable(message +
                         "; free some space and start again, nothing already written is lost");
    case EACCES:
    case EISDIR:
    case ENOTDIR:
    case ENAMETOOLONG:
      return invalid_argument(std::move(message));
    default:
      return unavailable(std::move(message));
  }
}

Result<FileDescriptor> open_file(std::string_view doing, const fs::path& path, int flags) {
  FileDescriptor fd(::open(path.c_str(), flags | O_CLOEXEC, 0644));
  if (!fd) return system_error(doing, path, errno);
  return fd;
}

// 0, or the errno of the write that failed.
int write_all(int fd, std::span<const std::byte> bytes) {
  while (!bytes.empty()) {
    const ssize_t n = ::write(fd, bytes.data(), bytes.size());
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) return n == 0 ? EIO : errno;
    bytes = bytes.subspan(static_cast<std::size_t>(n));
  }
  return 0;
}

Result<void> sync_path(const fs::path& path, int flags) {
  const Result<FileDescriptor> fd = open_file("sync", path, flags);
  if (!fd) return fd.error();
  if (::fsync(fd->get()) != 0) return system_error("sync", path, errno);
  return ok();
}

class SystemFiles final : public FileOperations {
 public:
  Result<void> make_directories(const fs::path& directory) override {
    if (::mkdir(directory.c_str(), 0755) == 0) return sync_directory(parent_of(directory));
    if (errno == EEXIST) {
      std::error_code ignored;
      if (fs::is_directory(directory, ignored)) return ok();
      return invalid_argument(fmt::format("{} exists and is not a directory", directory.string()));
    }
    if (errno != ENOENT || !directory.has_parent_path() || directory.parent_path() == directory) {
      return system_error("create directory", directory, errno);
    }
    if (auto made = make_directories(directory.parent_path()); !made) return made;
    return make_directories(directory);
  }

  Result<void> write(const fs::path& path, std::span<const std::byte> bytes) override {
    const Result<FileDescriptor> fd = open_file("write", path, O_WRONLY | O_CREAT | O_TRUNC);
    if (!fd) return fd.error();
    if (const int code = write_all(fd->get(), bytes); code != 0) {
      ::unlink(path.c_str());
      return system_error(fmt::format("write {} bytes to", bytes.size()), path, code);
    }
    return ok();
  }

  Result<void> append(const fs::path& path, std::span<const std::byte> bytes) override {
    const Result<FileDescriptor> fd = open_file("append to", path, O_WRONLY | O_CREAT | O_APPEND);
    if (!fd) return fd.error();
    struct stat before {};
    if (::fstat(fd->get(), &before) != 0) return system_error("append to", path, errno);
    if (const int code = write_all(fd->get(), bytes); code != 0) {
      Error error = system_error(fmt::format("append {} bytes to", bytes.size()), path, code);
      if (::ftruncate(fd->get(), before.st_size) != 0) error.message += "; a part of them remains";
      return error;
    }
    return ok();
  }

  Result<void> truncate(const fs::path& path, std::uint64_t size) override {
    if (::truncate(path.c_str(), static_cast<off_t>(size)) != 0) {
      return system_error("truncate", path, errno);
    }
    return ok();
  }

  Result<void> reserve(const fs::path& path, std::uint64_t bytes) override {
    const Result<FileDescriptor> fd = open_file("append to", path, O_WRONLY | O_CREAT | O_APPEND);
    if (!fd) return fd.error();
    struct stat status {};
    if (::fstat(fd->get(), &status) != 0) return system_error("append to", path, errno);
    const int failed =
        ::fallocate(fd->get(), FALLOC_FL_KEEP_SIZE, status.st_size, static_cast<off_t>(bytes));
    if (failed == 0 || errno == EOPNOTSUPP || errno == ENOSYS) return ok();
    return system_error(fmt::format("reserve {} bytes for", bytes), path, errno);
  }

  Result<void> sync(const fs::path& path) override { return sync_path(path, O_RDONLY); }

  Result<void> sync_directory(const fs::path& directory) override {
    return sync_path(directory, O_RDONLY | O_DIRECTORY);
  }

  Result<void> rename(const fs::path& from, const fs::path& to) override {
    if (::rename(from.c_str(), to.c_str()) != 0) return system_error("rename to", to, errno);
    return ok();
  }

  Result<void> remove(const fs::path& path) override {
    if (::unlink(path.c_str()) != 0) return system_error("remove", path, errno);
    return ok();
  }

  static fs::path parent_of(const fs::path& path) {
    return path.has_parent_path() ? path.parent_path() : fs::path(".");
  }
};

}  // namespace

FileOperations& system_files() {
  static SystemFiles instance;
  return instance;
}

Result<void> write_whole(FileOperations& files,
                         const fs::path& path,
                         std::span<const std::byte> bytes) {
  const fs::path temporary =
      path.parent_path() / ("." + path.filename().string() + std::string(kPartial));
  if (auto written = files.write(temporary, bytes); !written) return written;
  auto moved = files.sync(temporary);
  if (moved) moved = files.rename(temporary, path);
  if (!moved) {
    if (auto removed = files.remove(temporary); !removed) log::debug("{}", removed.error().message);
    return moved;
  }
  return files.sync_directory(path.has_parent_path() ? path.parent_path() : fs::path("."));
}

Result<void> write_whole(FileOperations& files, const fs::path& path, std::string_view text) {
  return write_whole(files, path, std::as_bytes(std::span(text.data(), text.size())));
}

void remove_partial_files(FileOperations& files, const fs::path& directory) {
  std::vector<fs::path> found;
  std::error_code error;
  for (fs::recursive_directory_iterator entry(directory, error), end; !error && entry != end;
       entry.increment(error)) {
    const std::string name = entry->path().filename().string();
    if (name.starts_with('.') && name.ends_with(kPartial)) found.push_back(entry->path());
  }
  for (const fs::path& path : found) {
    if (auto removed = files.remove(path); !removed) log::warning("{}", removed.error().message);
  }
}

Result<std::vector<std::byte>> read_bytes(const fs::path& path, std::size_t limit) {
  const Result<FileDescriptor> fd = open_file("read", path, O_RDONLY | O_NONBLOCK);
  if (!fd) return fd.error();
  struct stat status {};
  if (::fstat(fd->get(), &status) != 0) return system_error("read", path, errno);
  if (S_ISDIR(status.st_mode)) return system_error("read", path, EISDIR);
  if (!S_ISREG(status.st_mode)) {
    return invalid_argument(fmt::format("cannot read {}: it is no regular file", path.string()));
  }
  std::vector<std::byte> bytes(std::min(static_cast<std::size_t>(status.st_size), limit) + 1);
  std::size_t size = 0;
  for (;;) {
    const ssize_t n = ::read(fd->get(), bytes.data() + size, bytes.size() - size);
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) return system_error("read", path, errno);
    if (n == 0) break;
    size += static_cast<std::size_t>(n);
    if (size > limit) {
      return invalid_argument(
          fmt::format("{} is longer than the {} bytes allowed", path.string(), limit));
    }
    if (size == bytes.size()) bytes.resize(std::min(bytes.size() * 2, limit + 1));
  }
  bytes.resize(size);
  return bytes;
}

Result<std::string> read_text(const fs::path& path, std::size_t limit) {
  const auto bytes = read_bytes(path, limit);
  if (!bytes) return bytes.error();
  return std::string(reinterpret_cast<const char*>(bytes->data()), bytes->size());
}

}  // namespace opaline
