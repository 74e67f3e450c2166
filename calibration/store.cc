#include "calibration/store.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <charconv>
#include <system_error>
#include <utility>

#include "base/clock.h"
#include "base/format_version.h"

namespace opaline::calibration {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr int kActiveFormat = 1;
constexpr double kScatters = 1.25;
constexpr double kScattersBy = 0.1;

std::optional<int> version_of(const std::string& name) {
  int version = 0;
  const auto [end, error] = std::from_chars(name.data(), name.data() + name.size(), version);
  const bool good = error == std::errc() && end == name.data() + name.size() && version > 0;
  return good ? std::optional(version) : std::nullopt;
}

std::string failed_gates(const Record& record) {
  std::vector<std::string> names;
  for (const StepRecord& step : record.steps) {
    for (const Gate& gate : step.gates) {
      if (!gate.passed()) names.push_back(fmt::format("{}: {}", step.step, gate.name));
    }
  }
  return names.empty() ? "steps are missing" : fmt::format("{}", fmt::join(names, "; "));
}

}  // namespace

std::vector<int> Store::versions() const {
  std::vector<int> found;
  std::error_code error;
  for (fs::directory_iterator it(directory_, error), end; !error && it != end;
       it.increment(error)) {
    const auto version = version_of(it->path().filename().string());
    std::error_code none;
    if (version && fs::exists(it->path() / "calibration.json", none)) found.push_back(*version);
  }
  std::ranges::sort(found);
  return found;
}

fs::path Store::directory_of(int version) const {
  return directory_ / fmt::format("{:04}", version);
}

Result<Record> Store::read(int version) const {
  const fs::path file = directory_of(version) / "calibration.json";
  const auto text = read_text(file);
  if (text) return record_from_text(*text, file.string());
  if (text.error().code != ErrorCode::kNotFound) return text.error();
  const std::vector<int> all = versions();
  return not_found(fmt::format("no calibration {} in {}; there {}",
                               version,
                               directory_.string(),
                               all.empty() ? "is none: run \"opaline calibrate RIG.toml\""
                                           : fmt::format("are {}", fmt::join(all, ", "))));
}

Result<void> Store::write(const Record& record) const {
  const fs::path directory = directory_of(record.version);
  if (auto made = files_.make_directories(directory); !made) return made;
  return write_whole(files_, directory / "calibration.json", to_text(record));
}

Result<std::optional<int>> Store::active() const {
  const fs::path file = directory_ / "active.json";
  const auto text = read_text(file);
  if (!text && text.error().code == ErrorCode::kNotFound) return std::optional<int>();
  if (!text) return text.error();
  const json in = json::parse(*text, nullptr, false);
  const auto format = in.is_object() ? format_of(in) : std::nullopt;
  if (format && *format > kActiveFormat) return newer_format(file, *format, kActiveFormat);
  const auto found = in.is_object() ? in.find("active") : in.end();
  if (!format || found == in.end() || !found->is_number_integer()) {
    return invalid_argument(
        fmt::format("{} is damaged: choose again with \"opaline calibration activate VERSION\"",
                    file.string()));
  }
  return std::optional(found->get<int>());
}

Result<std::optional<Record>> Store::read_active() const {
  const auto version = active();
  if (!version) return version.error();
  if (!*version) return std::optional<Record>();
  auto record = read(**version);
  if (!record) return record.error().in("the active calibration");
  return std::optional(*std::move(record));
}

Result<void> Store::activate(int version) const {
  const auto record = read(version);
  if (!record) return record.error();
  if (record->state() != RecordState::kAccepted) {
    return invalid_argument(fmt::format("calibration {} is {}, not accepted ({}): it stays unused",
                                        version,
                                        to_string(record->state()),
                                        failed_gates(*record)));
  }
  const fs::path file = directory_ / "active.json";
  json history = json::array();
  if (const auto text = read_text(file); text) {
    const json old = json::parse(*text, nullptr, false);
    if (old.is_object() && old.value("history", json()).is_array()) history = old["history"];
  }
  history.push_back({{"version", version}, {"time", utc_now()}});
  const nlohmann::ordered_json out{
      {"format", kActiveFormat}, {"active", version}, {"history", std::move(history)}};
  return write_whole(files_, file, out.dump(2) + "\n");
}

Result<std::optional<int>> Store::used_before(int version) const {
  const auto text = read_text(directory_ / "active.json");
  if (!text && text.error().code == ErrorCode::kNotFound) return std::optional<int>();
  if (!text) return text.error();
  const json in = json::parse(*text, nullptr, false);
  std::optional<int> newest;
  const json history = in.is_object() ? in.value("history", json::array()) : json::array();
  for (const json& entry : history) {
    const int used = entry.is_object() ? entry.value("version", 0) : 0;
    if (used > 0 && used < version) newest = std::max(newest.value_or(0), used);
  }
  return newest;
}

std::vector<std::string> stations_in(const fs::path& root) {
  std::vector<std::string> found;
  std::error_code error;
  for (fs::directory_iterator it(root, error), end; !error && it != end; it.increment(error)) {
    std::error_code none;
    if (it->is_directory(none)) found.push_back(it->path().filename().string());
  }
  std::ranges::sort(found);
  return found;
}

bool should_activate(const Record& fresh, const std::optional<Record>& active) {
  if (fresh.state() != RecordState::kAccepted) return false;
  if (!active || active->camera != fresh.camera || active->projector != fresh.projector)
    return true;
  return fresh.margin() <= kScatters * active->margin() + kScattersBy;
}

}  // namespace opaline::calibration
