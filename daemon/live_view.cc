#include "daemon/live_view.h"

#include <system_error>
#include <utility>

#include "base/clock.h"
#include "daemon/jobs/station_lock.h"

namespace opaline::daemon {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kLongestAnswer = 64;

}  // namespace

fs::path live_directory(const fs::path& root, std::string_view station) {
  return root / station_lock_path(station).stem();
}

Result<std::unique_ptr<LiveView>> LiveView::create(FileOperations& files, fs::path directory) {
  if (auto made = files.make_directories(directory); !made) return made.error();
  Result<FileLock> lock = FileLock::acquire(directory / "lock");
  if (!lock) return lock.error();
  std::error_code none;
  for (const char* old : {"view.png", "view.json", "answer"}) fs::remove(directory / old, none);
  return std::unique_ptr<LiveView>(new LiveView(files, std::move(directory), *std::move(lock)));
}

Result<void> LiveView::show(std::span<const std::byte> png, nlohmann::json figures) {
  figures["format"] = 1;
  figures["frame"] = ++number_;
  figures["time"] = utc_now();
  if (auto written = write_whole(files_, directory_ / "view.png", png); !written) return written;
  return write_whole(files_, directory_ / "view.json", figures.dump() + "\n");
}

bool LiveView::is_watched(std::chrono::seconds within) const {
  std::error_code error;
  const auto looked = fs::last_write_time(directory_ / "watched", error);
  return !error && fs::file_time_type::clock::now() - looked <= within;
}

std::string LiveView::take_answer() const {
  const fs::path file = directory_ / "answer";
  std::error_code error;
  if (!fs::exists(file, error)) return {};
  const auto text = read_text(file, kLongestAnswer);
  fs::remove(file, error);
  return text ? *text : std::string();
}

}  // namespace opaline::daemon
