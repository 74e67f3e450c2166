#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"

namespace opaline {

/// The few operations by which files that matter reach the disk, so that a test can record and
/// replay them as a power cut would leave them. Nothing is durable before sync(); a name is durable
/// after sync_directory() of its directory.
///
/// Threads: safe to call from several threads on different paths.
/// Errors:  kUnavailable when the disk is full or gone, kNotFound, kInvalidArgument; each names
/// path and reason.
class FileOperations {
 public:
  virtual ~FileOperations() = default;
  /// Creates a directory and its parents, durably; existing ones are fine.
  virtual Result<void> make_directories(const std::filesystem::path& directory) = 0;
  /// Creates or replaces a file's content; a failed write leaves no file.
  virtual Result<void> write(const std::filesystem::path& path,
                             std::span<const std::byte> bytes) = 0;
  /// Appends, creating the file if needed; a failed append leaves the file as it was.
  virtual Result<void> append(const std::filesystem::path& path,
                              std::span<const std::byte> bytes) = 0;
  virtual Result<void> truncate(const std::filesystem::path& path, std::uint64_t size) = 0;
  /// Makes sure that the next `bytes` appended find room, creating the file if needed; its size
  /// stays. Where the file system cannot do that, nothing happens.
  virtual Result<void> reserve(const std::filesystem::path& /*path*/, std::uint64_t /*bytes*/) {
    return ok();
  }
  virtual Result<void> sync(const std::filesystem::path& path) = 0;
  virtual Result<void> sync_directory(const std::filesystem::path& directory) = 0;
  virtual Result<void> rename(const std::filesystem::path& from,
                              const std::filesystem::path& to) = 0;
  virtual Result<void> remove(const std::filesystem::path& path) = 0;
};

/// The machine's own files.
FileOperations& system_files();

/// Writes a file whole or not at all: a temporary beside it, sync, rename, sync of the directory.
/// On an error the old file is as it was.
Result<void> write_whole(FileOperations& files,
                         const std::filesystem::path& path,
                         std::span<const std::byte> bytes);
Result<void> write_whole(FileOperations& files,
                         const std::filesystem::path& path,
                         std::string_view text);

/// Removes the temporaries that write_whole() left anywhere below a directory when its process died.
/// Only for whoever may write there alone.
void remove_partial_files(FileOperations& files, const std::filesystem::path& directory);

/// Reads a whole file of at most `limit` bytes; a longer one is kInvalidArgument, and so is what is no
/// regular file (a pipe would keep us waiting).
Result<std::vector<std::byte>> read_bytes(const std::filesystem::path& path, std::size_t limit);
Result<std::string> read_text(const std::filesystem::path& path, std::size_t limit = 16u << 20);

}  // namespace opaline
