#include "daemon/session_factory.h"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <chrono>
#include <random>

#include "base/lock.h"

namespace opaline::daemon {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kNameLimit = 40;
constexpr std::size_t kIdLimit = 80;
constexpr std::string_view kNew = ".new-";
constexpr std::string_view kRemoved = ".removed-";

bool is_lower_alnum(char c) { return (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9'); }

std::string slug(std::string_view name) {
  std::string result;
  for (const char c : name) {
    const char lower = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    if (is_lower_alnum(lower)) {
      result += lower;
    } else if (!result.empty() && result.back() != '-') {
      result += '-';
    }
    if (result.size() == kNameLimit) break;
  }
  while (result.ends_with('-')) result.pop_back();
  return result.empty() ? "session" : result;
}

}  // namespace

std::string new_session_id(std::string_view name) {
  const auto now = std::chrono::system_clock::to_time_t(std::chrono::system_clock::now());
  std::random_device random;
  return fmt::format(
      "{:%Y%m%d-%H%M%S}-{:06x}-{}", fmt::gmtime(now), random() & 0xffffffU, slug(name));
}

bool is_session_id(std::string_view text) {
  return !text.empty() && text.size() <= kIdLimit && text.front() != '-' &&
         std::ranges::all_of(text, [](char c) { return is_lower_alnum(c) || c == '-'; });
}

Result<SessionDirectory> make_session(FileOperations& files,
                                      const fs::path& root,
                                      const SessionDirectory::Contents& contents) {
  const std::string id = new_session_id(contents.name);
  const fs::path hidden = root / (std::string(kNew) + id);
  if (auto made = SessionDirectory::create(files, hidden, contents); !made) {
    std::error_code ignored;
    fs::remove_all(hidden, ignored);
    return made.error();
  }
  if (auto named = files.rename(hidden, root / id); !named) return named.error();
  if (auto synced = files.sync_directory(root); !synced) return synced.error();
  return SessionDirectory::open(root / id);
}

Result<fs::path> hide_session(FileOperations& files, const SessionDirectory& session) {
  const Result<FileLock> lock = FileLock::acquire(session.lock());
  if (!lock) return lock.error().in("a job works on the session");
  const fs::path root = session.path().parent_path();
  fs::path hidden = root / (std::string(kRemoved) + session.id());
  if (auto renamed = files.rename(session.path(), hidden); !renamed) return renamed.error();
  if (auto synced = files.sync_directory(root); !synced) return synced.error();
  return hidden;
}

std::vector<fs::path> leftovers_in(const fs::path& root) {
  std::vector<fs::path> found;
  std::error_code error;
  for (fs::directory_iterator it(root, error), end; !error && it != end; it.increment(error)) {
    const std::string name = it->path().filename().string();
    if (name.starts_with(kNew) || name.starts_with(kRemoved)) found.push_back(it->path());
  }
  return found;
}

}  // namespace opaline::daemon
