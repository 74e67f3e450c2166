#pragma once

#include <cstdint>
#include <filesystem>
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

/// Reads whole, intact lines from `offset` on; a missing file is an empty log. A line is one JSON
/// object that ends in its own CRC-32:
/// {"seq":7,"time":"...","type":"...","data":{...},"crc":"89abcdef"}. Errors: kInvalidArgument for
/// a damaged line with intact ones behind it, naming the line.
Result<EventBatch> read_events(const std::filesystem::path& path, std::uint64_t offset = 0);

/// Appends to a session's log. One writer at a time, by the session's lock; thread-safe within the
/// process.
class EventLog {
 public:
  enum class Durability : std::uint8_t {
    kDurable,  ///< on disk when append() returns
    kRelaxed,  ///< may be lost with the power
  };

  /// Opens or creates, and cuts off a torn tail.
  static Result<std::unique_ptr<EventLog>> open(FileOperations& files,
                                                const std::filesystem::path& path);
  /// Returns the entry's number.
  Result<std::uint64_t> append(std::string_view type,
                               const nlohmann::json& data,
                               Durability durability = Durability::kDurable);

 private:
  EventLog(FileOperations& files, std::filesystem::path path, std::uint64_t last)
      : files_(files), path_(std::move(path)), last_(last) {}
  FileOperations& files_;  // outlives us
  std::filesystem::path path_;
  std::mutex mutex_;
  std::uint64_t last_;  // guarded by mutex_
};

}  // namespace opaline
