#pragma once

#include <chrono>
#include <cstddef>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <string_view>

#include "base/files.h"
#include "base/lock.h"
#include "base/result.h"

namespace opaline::daemon {

/// Where a station shows what its camera sees just now, for whoever serves it to browsers: by the station's name, below
/// this user's runtime directory. Odd characters of the name are underscores.
///
///   ROOT/STATION/lock        held while somebody shows pictures there
///   ROOT/STATION/view.png    the newest picture as people look at it
///   ROOT/STATION/view.json   its figures (docs/api.md); written after it
///   ROOT/STATION/watched     touched by whoever looks; removed: the viewfinder should end
///   ROOT/STATION/answer      what an operator says: "take" or "enough"; taken away by whoever asked
std::filesystem::path live_directory(const std::filesystem::path& root, std::string_view station);

/// Shows pictures there while it lives. The files stay behind; the lock does not, also when the process is killed.
class LiveView {
 public:
  /// Errors: kBusy while another shows pictures of this station; what the file system says.
  static Result<std::unique_ptr<LiveView>> create(FileOperations& files,
                                                  std::filesystem::path directory);
  /// A picture and its figures, to which number and time are added.
  Result<void> show(std::span<const std::byte> png, nlohmann::json figures);
  /// Whether somebody has looked within this time; true before anybody could.
  bool is_watched(std::chrono::seconds within) const;
  /// What an operator has said since the last call; empty: nothing.
  std::string take_answer() const;
  const std::filesystem::path& directory() const { return directory_; }

 private:
  LiveView(FileOperations& files, std::filesystem::path directory, FileLock lock)
      : files_(files), directory_(std::move(directory)), lock_(std::move(lock)) {}
  FileOperations& files_;  // outlives us
  std::filesystem::path directory_;
  FileLock lock_;
  int number_ = 0;
};

}  // namespace opaline::daemon
