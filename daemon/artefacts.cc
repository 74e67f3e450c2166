#include "daemon/artefacts.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <utility>

namespace opaline::daemon {
namespace {

namespace fs = std::filesystem;

bool is_plain(std::string_view piece) {
  return !piece.empty() && !piece.starts_with('.') && piece != "lock" &&
         piece.find('\0') == std::string_view::npos;
}

std::string content_type_of(std::string_view name) {
  static constexpr std::array<std::pair<std::string_view, std::string_view>, 8> kTypes{{
      {".html", "text/html; charset=utf-8"},
      {".json", "application/json"},
      {".jsonl", "application/x-ndjson"},
      {".toml", "application/toml"},
      {".png", "image/png"},
      {".exr", "image/x-exr"},
      {".log", "text/plain; charset=utf-8"},
      {".svg", "image/svg+xml"},
  }};
  const auto it = std::ranges::find_if(kTypes, [&](auto t) { return name.ends_with(t.first); });
  return std::string(it == kTypes.end() ? "application/octet-stream" : it->second);
}

Error no_such(std::string_view name) {
  return not_found(fmt::format("the session has no artefact \"{}\"", name));
}

bool is_missing(const std::error_code& error) {
  return error == std::errc::no_such_file_or_directory || error == std::errc::not_a_directory;
}

// Files and directories may go while we look: a job works here.
Result<void> collect(const fs::path& root,
                     const fs::path& below,
                     std::size_t limit,
                     std::vector<Artefact>& found) {
  std::error_code error;
  const fs::directory_iterator end;
  for (fs::directory_iterator it(root / below, error); !error && it != end; it.increment(error)) {
    if (found.size() >= limit) return ok();
    const fs::path name = it->path().filename();
    if (!is_plain(name.string())) continue;
    std::error_code gone;
    const fs::file_type type = it->symlink_status(gone).type();
    if (type == fs::file_type::directory) {
      if (auto inner = collect(root, below / name, limit, found); !inner) return inner;
    } else if (type == fs::file_type::regular) {
      const std::uint64_t size = it->file_size(gone);
      if (!gone) found.push_back({(below / name).string(), size});
    }
  }
  if (!error || is_missing(error)) return ok();
  return unavailable(fmt::format("{}: {}", (root / below).string(), error.message()));
}

}  // namespace

Result<std::vector<Artefact>> list_artefacts(const SessionDirectory& session, std::size_t limit) {
  std::vector<Artefact> found;
  if (auto listed = collect(session.path(), {}, limit, found); !listed) return listed.error();
  std::ranges::sort(found, {}, &Artefact::name);
  return found;
}

Result<OpenArtefact> open_artefact(const SessionDirectory& session, std::string_view name) {
  FileDescriptor at(::open(session.path().c_str(), O_PATH | O_DIRECTORY | O_CLOEXEC));
  std::string_view rest = name;
  while (at) {
    const std::size_t slash = rest.find('/');
    const std::string piece(rest.substr(0, slash));
    if (!is_plain(piece)) return no_such(name);
    const bool is_last = slash == std::string_view::npos;
    // O_NONBLOCK: a FIFO under a file's name must not hold us up.
    const int flags = is_last ? O_RDONLY | O_NONBLOCK : O_PATH | O_DIRECTORY;
    at = FileDescriptor(::openat(at.get(), piece.c_str(), flags | O_NOFOLLOW | O_CLOEXEC));
    if (is_last) break;
    rest.remove_prefix(slash + 1);
  }
  struct stat status {};
  if (!at || ::fstat(at.get(), &status) != 0 || !S_ISREG(status.st_mode)) return no_such(name);
  return OpenArtefact{
      std::move(at), static_cast<std::uint64_t>(status.st_size), content_type_of(name)};
}

}  // namespace opaline::daemon
