#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "base/files.h"
#include "base/result.h"

namespace opaline {

/// One numbered entry of a session's event log.
struct Event {
  std::uint64_t seq = 0;  ///< 1, 2, 3, ...
  std::string time;       ///< UTC, for people
  std::string type;       ///< "job.started", "region.captured", "progress", ...
  nlohmann::json data;
};

/// What was read from a log, and where to read on.
struct EventBatch {
  std::vector<Event> events;
  std::uint64_t next_offset = 0;  ///< in bytes; a torn or unfinished tail lies after it
};

/// Visits the whole, intact lines from `offset` on, one at a time however long the log, and returns
/// where to read on; a missing file is an empty log. A line is one JSON object that ends in its own
/// CRC-32:
///
///   {"seq":7,"time":"...","type":"...","data":{...},"crc":"89abcdef"}
///
/// Behind a line that is damaged or out of sequence stands nothing but progress: after a power cut
/// that is a torn tail. Errors: kInvalidArgument when facts stand behind one, naming it.
Result<std::uint64_t> scan_events(const std::filesystem::path& path,
                                  std::uint64_t offset,
                                  const std::function<void(Event&&)>& visit);

/// The same, as a list.
Result<EventBatch> read_events(const std::filesystem::path& path, std::uint64_t offset = 0);

/// Appends to a session's log. One writer at a time, by the session's lock; thread-safe within the
/// process.
class EventLog {
 public:
  enum class Durability : std::uint8_t {
    kDurable,  ///< on disk when append() returns
    kRelaxed,  ///< may be lost with the power; of type "progress" only
  };

  /// Opens or creates, and cuts off a torn tail.
  static Result<std::unique_ptr<EventLog>> open(FileOperations& files,
                                                const std::filesystem::path& path);
  /// Returns the entry's number. Some room on the disk is kept for what is still to be said, so that
  /// on a full one there is no progress any more (kUnavailable), but the job's end is still told.
  Result<std::uint64_t> append(std::string_view type,
                               const nlohmann::json& data,
                               Durability durability = Durability::kDurable);

 private:
  EventLog(FileOperations& files, std::filesystem::path path, std::uint64_t last)
      : files_(files), path_(std::move(path)), last_(last) {}
  Result<void> keep_room(std::size_t bytes);
  FileOperations& files_;  // outlives us
  std::filesystem::path path_;
  std::mutex mutex_;
  std::uint64_t last_;    // guarded by mutex_
  std::size_t room_ = 0;  // reserved for entries to come; guarded by mutex_
  bool named_ = false;    // the file's name is durable; guarded by mutex_
};

}  // namespace opaline
