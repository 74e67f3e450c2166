#include "base/event_log.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>
#include <zlib.h>

#include <cerrno>
#include <optional>
#include <system_error>

#include "base/clock.h"
#include "base/file_descriptor.h"

namespace opaline {
namespace {

constexpr std::size_t kLogLimit = 256u << 20;
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

// The rest of the file; a follower asks for it several times a second.
Result<std::string> read_from(const std::filesystem::path& path, std::uint64_t offset) {
  const FileDescriptor fd(::open(path.c_str(), O_RDONLY | O_CLOEXEC));
  if (!fd && errno == ENOENT) return not_found(path.string());
  struct stat status {};
  if (!fd || ::fstat(fd.get(), &status) != 0) return unreadable(path);
  const auto size = static_cast<std::uint64_t>(status.st_size);
  if (offset > size) {
    return invalid_argument(fmt::format("{} is shorter than offset {}", path.string(), offset));
  }
  if (size - offset > kLogLimit) return invalid_argument(path.string() + " is too long for a log");
  std::string text(size - offset, '\0');
  for (std::size_t got = 0; got < text.size();) {
    const ssize_t n =
        ::pread(fd.get(), text.data() + got, text.size() - got, static_cast<off_t>(offset + got));
    if (n < 0 && errno != EINTR) return unreadable(path);
    if (n == 0) text.resize(got);  // cut off meanwhile
    if (n > 0) got += static_cast<std::size_t>(n);
  }
  return text;
}

struct Line {
  std::string_view text;
  std::uint64_t end = 0;  // just after its newline
};

std::vector<Line> finished_lines(std::string_view text) {
  std::vector<Line> lines;
  std::size_t begin = 0;
  for (std::size_t end = text.find('\n', begin); end != std::string_view::npos;
       end = text.find('\n', begin)) {
    lines.push_back({text.substr(begin, end - begin), end + 1});
    begin = end + 1;
  }
  return lines;
}

}  // namespace

Result<EventBatch> read_events(const std::filesystem::path& path, std::uint64_t offset) {
  const Result<std::string> text = read_from(path, offset);
  if (!text && text.error().code == ErrorCode::kNotFound) return EventBatch{};
  if (!text) return text.error();
  EventBatch batch{{}, offset};
  std::size_t damaged = 0;
  std::size_t number = 0;
  for (const Line& line : finished_lines(*text)) {
    ++number;
    std::optional<Event> event = parse_line(line.text);
    if (!event) {
      if (damaged == 0) damaged = number;
    } else if (damaged != 0) {
      return invalid_argument(
          fmt::format("{}: entry {} after byte {} is damaged, and intact ones follow it: restore "
                      "the file from a copy",
                      path.string(),
                      damaged,
                      offset));
    } else {
      batch.events.push_back(*std::move(event));
      batch.next_offset = offset + line.end;
    }
  }
  return batch;
}

Result<std::unique_ptr<EventLog>> EventLog::open(FileOperations& files,
                                                 const std::filesystem::path& path) {
  const Result<EventBatch> batch = read_events(path);
  if (!batch) return batch.error();
  std::error_code none;
  const auto size = std::filesystem::file_size(path, none);
  if (!none && size > batch->next_offset) {
    if (auto cut = files.truncate(path, batch->next_offset); !cut) return cut.error();
    if (auto synced = files.sync(path); !synced) return synced.error();
  }
  const std::uint64_t last = batch->events.empty() ? 0 : batch->events.back().seq;
  return std::unique_ptr<EventLog>(new EventLog(files, path, last));
}

Result<std::uint64_t> EventLog::append(std::string_view type,
                                       const nlohmann::json& data,
                                       Durability durability) {
  const std::lock_guard lock(mutex_);
  const std::string line = line_of({last_ + 1, utc_now(), std::string(type), data});
  const auto bytes = std::as_bytes(std::span(line.data(), line.size()));
  if (auto appended = files_.append(path_, bytes); !appended) return appended.error();
  ++last_;
  if (durability == Durability::kDurable) {
    if (auto synced = files_.sync(path_); !synced) return synced.error();
    if (last_ == 1) {
      if (auto synced = files_.sync_directory(path_.parent_path()); !synced) return synced.error();
    }
  }
  return last_;
}

}  // namespace opaline
