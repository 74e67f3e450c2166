#pragma once

#include <filesystem>

#include "base/file_descriptor.h"
#include "base/result.h"

namespace opaline {

/// An exclusive kernel lock on a file (Linux open-file-description lock): held while this object
/// lives, given up by the kernel when the process dies, however it dies. Never inherited across
/// exec.
class FileLock {
 public:
  /// Creates the file if needed, for every user to lock; follows no link. kBusy at once when
  /// somebody holds the lock.
  static Result<FileLock> acquire(const std::filesystem::path& path);
  /// Whether somebody holds it; asks without taking it. A missing file is not held.
  static Result<bool> is_held(const std::filesystem::path& path);

 private:
  explicit FileLock(FileDescriptor fd) : fd_(std::move(fd)) {}
  FileDescriptor fd_;
};

}  // namespace opaline
