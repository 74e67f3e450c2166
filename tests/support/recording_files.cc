#include "tests/support/recording_files.h"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <map>
#include <memory>
#include <random>
#include <utility>

#include "base/ensure.h"

namespace opaline::support {
namespace {

namespace fs = std::filesystem;
using Kind = FileOperation::Kind;
using Bytes = std::vector<std::byte>;

/// One file's content: what is safe, and what was done to it since, latest last.
struct Content {
  Bytes safe;
  std::vector<Bytes> since;  // the whole content after each change
  const Bytes& now() const { return since.empty() ? safe : since.back(); }
};
using Node = std::shared_ptr<Content>;
using Names = std::map<fs::path, Node>;  // of one directory

struct Directory {
  Names safe;
  std::vector<Names> since;  // all names after each change
  const Names& now() const { return since.empty() ? safe : since.back(); }
};

/// A disk with a volatile cache. A file system keeps the order of a directory's changes.
class Disk {
 public:
  void apply(const FileOperation& operation);
  void lay_out(std::mt19937_64& random, const fs::path& root) const;

 private:
  Node& node(const fs::path& path) {
    Directory& directory = directories_[path.parent_path()];
    Names names = directory.now();
    Node& found = names[path.filename()];
    if (!found) {
      found = std::make_shared<Content>();
      directory.since.push_back(names);
    }
    return nodes_[path] = found;
  }
  void rename(const fs::path& from, const fs::path& to) {
    Directory& directory = directories_[from.parent_path()];
    ENSURE(from.parent_path() == to.parent_path());
    Names names = directory.now();
    names[to.filename()] = names.at(from.filename());
    names.erase(from.filename());
    directory.since.push_back(std::move(names));
  }
  void remove(const fs::path& path) {
    Directory& directory = directories_[path.parent_path()];
    Names names = directory.now();
    names.erase(path.filename());
    directory.since.push_back(std::move(names));
  }
  std::map<fs::path, Directory> directories_;
  std::map<fs::path, Node> nodes_;
};

Bytes joined(Bytes first, const Bytes& second) {
  first.insert(first.end(), second.begin(), second.end());
  return first;
}

void Disk::apply(const FileOperation& o) {
  switch (o.kind) {
    case Kind::kMakeDirectories:
      directories_[o.path];
      return;
    case Kind::kWrite: {
      Content& content = *node(o.path);
      content.since.emplace_back();  // cut to nothing first
      content.since.push_back(o.bytes);
      return;
    }
    case Kind::kAppend: {
      Content& content = *node(o.path);
      content.since.push_back(joined(content.now(), o.bytes));
      return;
    }
    case Kind::kTruncate: {
      Content& content = *node(o.path);
      Bytes cut = content.now();
      cut.resize(o.size);
      content.since.push_back(std::move(cut));
      return;
    }
    case Kind::kSync: {
      Content& content = *node(o.path);
      content.safe = content.now();
      content.since.clear();
      return;
    }
    case Kind::kSyncDirectory: {
      Directory& directory = directories_[o.path];
      directory.safe = directory.now();
      directory.since.clear();
      return;
    }
    case Kind::kRename:
      return rename(o.path, o.to);
    case Kind::kRemove:
      return remove(o.path);
  }
}

std::size_t below(std::mt19937_64& random, std::size_t count) {
  return count == 0 ? 0 : static_cast<std::size_t>(random() % count);
}

// Content after a crash: one of its states since the last sync, the newest part of it perhaps torn
// off or never written over the zeros of fresh blocks.
Bytes after_crash(const Content& content, std::mt19937_64& random) {
  const std::size_t state = below(random, content.since.size() + 1);
  if (state == 0) return content.safe;
  Bytes bytes = content.since[state - 1];
  const Bytes& before = state == 1 ? content.safe : content.since[state - 2];
  const std::size_t kept = std::min(before.size(), bytes.size());
  const std::size_t written = kept + below(random, bytes.size() - kept + 1);
  switch (below(random, 3)) {
    case 0:
      bytes.resize(written);
      break;
    case 1:
      std::fill(bytes.begin() + static_cast<std::ptrdiff_t>(written), bytes.end(), std::byte{0});
      break;
    default:
      break;
  }
  return bytes;
}

void Disk::lay_out(std::mt19937_64& random, const fs::path& root) const {
  std::map<Node, Bytes> contents;  // a file under two names is one file
  for (const auto& [path, directory] : directories_) {
    fs::create_directories(root / path);
    const std::size_t state = below(random, directory.since.size() + 1);
    const Names& names = state == 0 ? directory.safe : directory.since[state - 1];
    for (const auto& [name, file] : names) {
      const auto [found, fresh] = contents.try_emplace(file);
      if (fresh) found->second = after_crash(*file, random);
      std::ofstream out(root / path / name, std::ios::binary);
      out.write(reinterpret_cast<const char*>(found->second.data()),
                static_cast<std::streamsize>(found->second.size()));
    }
  }
}

class UnsyncedFiles final : public FileOperations {
 public:
  Result<void> make_directories(const fs::path& directory) override {
    return system_files().make_directories(directory);
  }
  Result<void> write(const fs::path& path, std::span<const std::byte> bytes) override {
    return system_files().write(path, bytes);
  }
  Result<void> append(const fs::path& path, std::span<const std::byte> bytes) override {
    return system_files().append(path, bytes);
  }
  Result<void> truncate(const fs::path& path, std::uint64_t size) override {
    return system_files().truncate(path, size);
  }
  Result<void> sync(const fs::path& /*path*/) override { return ok(); }
  Result<void> sync_directory(const fs::path& /*directory*/) override { return ok(); }
  Result<void> rename(const fs::path& from, const fs::path& to) override {
    return system_files().rename(from, to);
  }
  Result<void> remove(const fs::path& path) override { return system_files().remove(path); }
};

}  // namespace

Result<void> RecordingFiles::note(Result<void> result, FileOperation operation) {
  if (!result) return result;
  operation.path = operation.path.lexically_relative(root_);
  if (!operation.to.empty()) operation.to = operation.to.lexically_relative(root_);
  const std::lock_guard lock(mutex_);
  operations_.push_back(std::move(operation));
  return result;
}

Result<void> RecordingFiles::make_directories(const fs::path& directory) {
  return note(system_files().make_directories(directory),
              {Kind::kMakeDirectories, directory, {}, {}, 0});
}
Result<void> RecordingFiles::write(const fs::path& path, std::span<const std::byte> bytes) {
  return note(system_files().write(path, bytes),
              {Kind::kWrite, path, {}, {bytes.begin(), bytes.end()}, 0});
}
Result<void> RecordingFiles::append(const fs::path& path, std::span<const std::byte> bytes) {
  return note(system_files().append(path, bytes),
              {Kind::kAppend, path, {}, {bytes.begin(), bytes.end()}, 0});
}
Result<void> RecordingFiles::truncate(const fs::path& path, std::uint64_t size) {
  return note(system_files().truncate(path, size), {Kind::kTruncate, path, {}, {}, size});
}
Result<void> RecordingFiles::sync(const fs::path& path) {
  return note(system_files().sync(path), {Kind::kSync, path, {}, {}, 0});
}
Result<void> RecordingFiles::sync_directory(const fs::path& directory) {
  return note(system_files().sync_directory(directory),
              {Kind::kSyncDirectory, directory, {}, {}, 0});
}
Result<void> RecordingFiles::rename(const fs::path& from, const fs::path& to) {
  return note(system_files().rename(from, to), {Kind::kRename, from, to, {}, 0});
}
Result<void> RecordingFiles::remove(const fs::path& path) {
  return note(system_files().remove(path), {Kind::kRemove, path, {}, {}, 0});
}

Result<void> FullDisk::take(const fs::path& path, std::size_t bytes) {
  if (bytes > room_) {
    return unavailable(
        fmt::format("cannot write {} bytes to {}: no space left on device", bytes, path.string()));
  }
  room_ -= bytes;
  return ok();
}

Result<void> FullDisk::make_directories(const fs::path& directory) {
  return unsynced_files().make_directories(directory);
}
Result<void> FullDisk::write(const fs::path& path, std::span<const std::byte> bytes) {
  if (auto room = take(path, bytes.size()); !room) return room;
  return unsynced_files().write(path, bytes);
}
Result<void> FullDisk::append(const fs::path& path, std::span<const std::byte> bytes) {
  std::size_t& reserved = reserved_[path];
  const std::size_t from_reserve = std::min(reserved, bytes.size());
  if (auto room = take(path, bytes.size() - from_reserve); !room) return room;
  reserved -= from_reserve;
  return unsynced_files().append(path, bytes);
}
Result<void> FullDisk::reserve(const fs::path& path, std::uint64_t bytes) {
  std::size_t& reserved = reserved_[path];
  if (reserved >= bytes) return ok();
  if (auto room = take(path, bytes - reserved); !room) return room;
  reserved = bytes;
  return ok();
}
Result<void> FullDisk::truncate(const fs::path& path, std::uint64_t size) {
  return unsynced_files().truncate(path, size);
}
Result<void> FullDisk::sync(const fs::path& path) { return unsynced_files().sync(path); }
Result<void> FullDisk::sync_directory(const fs::path& directory) {
  return unsynced_files().sync_directory(directory);
}
Result<void> FullDisk::rename(const fs::path& from, const fs::path& to) {
  return unsynced_files().rename(from, to);
}
Result<void> FullDisk::remove(const fs::path& path) { return unsynced_files().remove(path); }

FileOperations& unsynced_files() {
  static UnsyncedFiles instance;
  return instance;
}

std::vector<FileOperation> RecordingFiles::operations() const {
  const std::lock_guard lock(mutex_);
  return operations_;
}

void replay_power_loss(std::span<const FileOperation> operations,
                       std::uint64_t seed,
                       const fs::path& directory) {
  Disk disk;
  for (const FileOperation& operation : operations) disk.apply(operation);
  std::mt19937_64 random(seed);
  disk.lay_out(random, directory);
}

}  // namespace opaline::support
