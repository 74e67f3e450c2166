#include "capture/lamp_file.h"

#include <nlohmann/json.hpp>

namespace opaline::capture {
namespace {

constexpr const char* kLampFile = "lamps.json";

}  // namespace

Result<void> write_lamp_check(FileOperations& files,
                              const std::filesystem::path& directory,
                              const LampCheck& check) {
  const nlohmann::ordered_json json{
      {"format", 1}, {"tried", check.tried.size()}, {"dead", check.dead}};
  return write_whole(files, directory / kLampFile, json.dump() + "\n");
}

std::optional<std::vector<int>> read_lamp_check(const std::filesystem::path& directory) {
  const auto text = read_text(directory / kLampFile);
  if (!text) return std::nullopt;
  const auto json = nlohmann::json::parse(*text, nullptr, false);
  if (!json.is_object() || !json.contains("dead") || !json["dead"].is_array()) return std::nullopt;
  std::vector<int> dead;
  for (const auto& lamp : json["dead"])
    if (lamp.is_number_unsigned()) dead.push_back(lamp.get<int>());
  return dead;
}

}  // namespace opaline::capture
