#include "base/event_log.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>
#include <zlib.h>

#include <algorithm>
#include <cerrno>
#include <optional>
#include <system_error>
#include <utility>

#include "base/clock.h"
#include "base/file_descriptor.h"

namespace opaline {
namespace {

constexpr std::size_t kLineLimit = 16u << 20;
constexpr std::size_t kChunk = 256u << 10;
constexpr std::size_t kRoom = 32u << 10;                // kept on the disk for entries to come ...
constexpr std::size_t kRoomForFacts = 8u << 10;         // ... of which so much for durable ones
constexpr std::string_view kProgressType = "progress";  // the only entries that are not durable
constexpr std::string_view kCrcKey = R"(,"crc":")";
constexpr std::size_t kTailSize = kCrcKey.size() + 8 + 2;  // key, eight digits, "}

std::string crc_of(std::string_view text) {
  const auto crc =
      ::crc32(0, reinterpret_cast<const Bytef*>(text.data()), static_cast<uInt>(text.size()));
  return fmt::format("{:08x}", crc);
}

std::string line_of(const Event& event) {
  nlohmann::ordered_json body;
  body["seq"] = event.seq;
  body["time"] = event.time;
  body["type"] = event.type;
  body["data"] = event.data;
  std::string line = body.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
  line.pop_back();  // the closing brace
  return fmt::format("{}{}{}\"}}\n", line, kCrcKey, crc_of(line));
}

std::optional<Event> parse_line(std::string_view line) {
  if (line.size() < kTailSize || !line.ends_with("\"}")) return std::nullopt;
  const std::string_view body = line.substr(0, line.size() - kTailSize);
  const std::string_view tail = line.substr(line.size() - kTailSize);
  if (!tail.starts_with(kCrcKey) || tail.substr(kCrcKey.size(), 8) != crc_of(body)) {
    return std::nullopt;
  }
  const auto json = nlohmann::json::parse(line, nullptr, false);
  if (!json.is_object() || !json.contains("seq") || !json["seq"].is_number_unsigned() ||
      !json.contains("type") || !json["type"].is_string() || !json.contains("data")) {
    return std::nullopt;
  }
  return Event{json["seq"].get<std::uint64_t>(),
               json.contains("time") && json["time"].is_string() ? json["time"].get<std::string>()
                                                                 : std::string(),
               json["type"].get<std::string>(),
               json["data"]};
}

Error unreadable(const std::filesystem::path& path) {
  return unavailable(
      fmt::format("cannot read {}: {}", path.string(), std::generic_category().message(errno)));
}

/// The finished lines of a file, one after the other, however long the file is.
class LineReader {
 public:
  LineReader(FileDescriptor fd, const std::filesystem::path& path, std::uint64_t offset)
      : fd_(std::move(fd)), path_(path), end_(offset), read_to_(offset) {}

  /// None at the end. A line over the limit comes as an empty one.
  Result<std::optional<std::string_view>> next() {
    for (;;) {
      const std::size_t newline = buffer_.find('\n', searched_);
      if (newline != std::string::npos) return take(newline);
      searched_ = buffer_.size();
      const auto more = fill();
      if (!more) return more.error();
      if (!*more) return std::optional<std::string_view>();
    }
  }
  /// In bytes, just after the newline of the last line.
  std::uint64_t end() const { return end_; }

 private:
  std::optional<std::string_view> take(std::size_t newline) {
    const auto line = std::string_view(buffer_).substr(begin_, newline - begin_);
    end_ += line.size() + 1;
    begin_ = searched_ = newline + 1;
    return std::exchange(too_long_, false) ? std::string_view() : line;
  }

  // False at the end of the file.
  Result<bool> fill() {
    buffer_.erase(0, begin_);
    begin_ = 0;
    if (buffer_.size() > kLineLimit) {
      end_ += buffer_.size();
      buffer_.clear();
      too_long_ = true;
    }
    const std::size_t had = buffer_.size();
    searched_ = had;
    buffer_.resize(had + kChunk);
    ssize_t n = 0;
    do {
      n = ::pread(fd_.get(), buffer_.data() + had, kChunk, static_cast<off_t>(read_to_));
    } while (n < 0 && errno == EINTR);
    if (n < 0) return unreadable(path_);
    buffer_.resize(had + static_cast<std::size_t>(n));
    read_to_ += static_cast<std::uint64_t>(n);
    return n > 0;
  }

  FileDescriptor fd_;
  const std::filesystem::path& path_;
  std::uint64_t end_;
  std::uint64_t read_to_;
  std::string buffer_;
  std::size_t begin_ = 0;     // of the line to come, in the buffer
  std::size_t searched_ = 0;  // no newline between it and here
  bool too_long_ = false;     // the line to come: its beginning was dropped
};

}  // namespace

Result<std::uint64_t> scan_events(const std::filesystem::path& path,
                                  std::uint64_t offset,
                                  const std::function<void(Event&&)>& visit) {
  FileDescriptor fd(::open(path.c_str(), O_RDONLY | O_CLOEXEC));
  if (!fd && errno == ENOENT) return 0;
  struct stat status {};
  if (!fd || ::fstat(fd.get(), &status) != 0) return unreadable(path);
  if (offset > static_cast<std::uint64_t>(status.st_size)) {
    return invalid_argument(fmt::format("{} is shorter than offset {}", path.string(), offset));
  }
  LineReader lines(std::move(fd), path, offset);
  std::uint64_t next_offset = offset;
  std::optional<std::uint64_t> seq;  // of the last one; not known in the middle of a log
  if (offset == 0) seq = 0;
  std::size_t number = 0;
  std::size_t damaged = 0;
  for (;;) {
    const auto line = lines.next();
    if (!line) return line.error();
    if (!*line) return next_offset;
    ++number;
    std::optional<Event> event = parse_line(**line);
    if (damaged == 0 && (!event || (seq && event->seq != *seq + 1))) damaged = number;
    if (damaged != 0 && event && event->type != kProgressType) {
      return invalid_argument(
          fmt::format("{}: entry {} after byte {} is damaged or out of sequence, and facts stand "
                      "behind it: restore the file from a copy",
                      path.string(),
                      damaged,
                      offset));
    }
    if (damaged != 0) continue;
    seq = event->seq;
    next_offset = lines.end();
    visit(*std::move(event));
  }
}

Result<EventBatch> read_events(const std::filesystem::path& path, std::uint64_t offset) {
  EventBatch batch;
  const auto next =
      scan_events(path, offset, [&](Event&& event) { batch.events.push_back(std::move(event)); });
  if (!next) return next.error();
  batch.next_offset = *next;
  return batch;
}

Result<std::unique_ptr<EventLog>> EventLog::open(FileOperations& files,
                                                 const std::filesystem::path& path) {
  std::uint64_t last = 0;
  const auto end = scan_events(path, 0, [&](const Event& event) { last = event.seq; });
  if (!end) return end.error();
  std::error_code none;
  const auto size = std::filesystem::file_size(path, none);
  if (!none && size > *end) {
    if (auto cut = files.truncate(path, *end); !cut) return cut.error();
    if (auto synced = files.sync(path); !synced) return synced.error();
  }
  return std::unique_ptr<EventLog>(new EventLog(files, path, last));
}

Result<std::uint64_t> EventLog::append(std::string_view type,
                                       const nlohmann::json& data,
                                       Durability durability) {
  const std::lock_guard lock(mutex_);
  const std::string line = line_of({last_ + 1, utc_now(), std::string(type), data});
  if (line.size() > kLineLimit) {
    return invalid_argument(fmt::format("an entry of {} bytes is too long", line.size()));
  }
  if (auto room = keep_room(line.size()); !room && durability == Durability::kRelaxed) {
    return room.error();
  }
  const auto bytes = std::as_bytes(std::span(line.data(), line.size()));
  if (auto appended = files_.append(path_, bytes); !appended) return appended.error();
  room_ -= std::min(room_, line.size());
  ++last_;
  if (durability == Durability::kRelaxed) return last_;
  if (auto synced = files_.sync(path_); !synced) return synced.error();
  if (!named_) {
    if (auto synced = files_.sync_directory(path_.parent_path()); !synced) return synced.error();
    named_ = true;
  }
  return last_;
}

// Before an entry of `bytes`.
Result<void> EventLog::keep_room(std::size_t bytes) {
  if (room_ >= bytes + kRoomForFacts) return ok();
  if (auto reserved = files_.reserve(path_, bytes + kRoom); !reserved) return reserved;
  room_ = bytes + kRoom;
  return ok();
}

}  // namespace opaline
