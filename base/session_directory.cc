#include "base/session_directory.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "base/clock.h"
#include "base/format_version.h"

namespace opaline {
namespace {

std::filesystem::path marker(const std::filesystem::path& directory) {
  return directory / "session.json";
}

}  // namespace

Result<SessionDirectory> SessionDirectory::create(FileOperations& files,
                                                  const std::filesystem::path& path,
                                                  const Contents& contents) {
  std::error_code none;
  if (std::filesystem::exists(marker(path), none)) {
    return busy(fmt::format("{} is a session already", path.string()));
  }
  if (auto made = files.make_directories(path); !made) return made.error();
  SessionDirectory session(path, contents.name);
  const std::pair<std::filesystem::path, const std::string&> texts[] = {
      {session.session_toml(), contents.session_toml},
      {session.rig_toml(), contents.rig_toml},
      {session.resolved_toml(), contents.resolved_toml}};
  for (const auto& [file, text] : texts) {
    if (auto written = write_whole(files, file, text); !written) return written.error();
  }
  const nlohmann::json json{{"format", kFormat}, {"name", contents.name}, {"created", utc_now()}};
  if (auto written = write_whole(files, marker(path), json.dump(2) + "\n"); !written) {
    return written.error();
  }
  return session;
}

Result<SessionDirectory> SessionDirectory::open(const std::filesystem::path& path) {
  const std::filesystem::path directory =
      path.has_filename() ? path : path.parent_path();  // "session/" names the same thing
  const Result<std::string> text = read_text(marker(directory), 64u << 10);
  if (!text && text.error().code == ErrorCode::kNotFound) {
    return not_found(
        fmt::format("{} is not a session directory: it has no session.json", path.string()));
  }
  if (!text) return text.error();
  const auto json = nlohmann::json::parse(*text, nullptr, false);
  const auto format = format_of(json);
  if (!format) {
    return invalid_argument(
        fmt::format("{} is damaged: restore it from a copy", marker(directory).string()));
  }
  if (*format > kFormat) return newer_format(directory, *format, kFormat);
  const auto name = json.find("name");
  return SessionDirectory(
      directory,
      name != json.end() && name->is_string() ? name->get<std::string>() : std::string());
}

}  // namespace opaline
