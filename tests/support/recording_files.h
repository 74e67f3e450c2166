#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <mutex>
#include <span>
#include <string>
#include <vector>

#include "base/files.h"

namespace opaline::support {

/// One call to a FileOperations, by paths relative to the recorded directory.
struct FileOperation {
  enum class Kind : std::uint8_t {
    kMakeDirectories,
    kWrite,
    kAppend,
    kTruncate,
    kSync,
    kSyncDirectory,
    kRename,
    kRemove
  };
  Kind kind = Kind::kWrite;
  std::filesystem::path path;
  std::filesystem::path to;      ///< of a rename
  std::vector<std::byte> bytes;  ///< of a write or append
  std::uint64_t size = 0;        ///< of a truncate
};

/// Passes everything on to the machine's own files and writes down what succeeded. Thread-safe.
class RecordingFiles : public FileOperations {
 public:
  explicit RecordingFiles(std::filesystem::path root) : root_(std::move(root)) {}
  Result<void> make_directories(const std::filesystem::path& directory) override;
  Result<void> write(const std::filesystem::path& path, std::span<const std::byte> bytes) override;
  Result<void> append(const std::filesystem::path& path, std::span<const std::byte> bytes) override;
  Result<void> truncate(const std::filesystem::path& path, std::uint64_t size) override;
  Result<void> sync(const std::filesystem::path& path) override;
  Result<void> sync_directory(const std::filesystem::path& directory) override;
  Result<void> rename(const std::filesystem::path& from, const std::filesystem::path& to) override;
  Result<void> remove(const std::filesystem::path& path) override;

  std::vector<FileOperation> operations() const;

 private:
  Result<void> note(Result<void> result, FileOperation operation);
  std::filesystem::path root_;
  mutable std::mutex mutex_;
  std::vector<FileOperation> operations_;  // guarded by mutex_
};

/// The machine's own files without waiting for the disk: for tests in which no power fails.
FileOperations& unsynced_files();

/// A disk with room for so many bytes more: a write or append past it fails as the system's does, and
/// leaves nothing behind. What was reserved for a file is taken from the room then, and not again.
class FullDisk : public FileOperations {
 public:
  explicit FullDisk(std::size_t room) : room_(room) {}
  Result<void> reserve(const std::filesystem::path& path, std::uint64_t bytes) override;
  Result<void> make_directories(const std::filesystem::path& directory) override;
  Result<void> write(const std::filesystem::path& path, std::span<const std::byte> bytes) override;
  Result<void> append(const std::filesystem::path& path, std::span<const std::byte> bytes) override;
  Result<void> truncate(const std::filesystem::path& path, std::uint64_t size) override;
  Result<void> sync(const std::filesystem::path& path) override;
  Result<void> sync_directory(const std::filesystem::path& directory) override;
  Result<void> rename(const std::filesystem::path& from, const std::filesystem::path& to) override;
  Result<void> remove(const std::filesystem::path& path) override;

 private:
  Result<void> take(const std::filesystem::path& path, std::size_t bytes);
  std::size_t room_;
  std::map<std::filesystem::path, std::size_t> reserved_;
};

/// Lays out in `directory` what a disk may hold after the power failed behind the last of
/// `operations`: what was synced is there; of what was not, content is dropped, torn, zeroed from
/// somewhere on, or there, and of each directory's changes of names a first part is kept, as the seed
/// has it.
void replay_power_loss(std::span<const FileOperation> operations,
                       std::uint64_t seed,
                       const std::filesystem::path& directory);

}  // namespace opaline::support
