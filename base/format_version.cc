#include "base/format_version.h"

#include <fmt/format.h>

namespace opaline {

std::optional<std::uint64_t> format_of(const nlohmann::json& document) {
  const auto found = document.find("format");
  if (found == document.end() || !found->is_number_integer()) return std::nullopt;
  if (!found->is_number_unsigned() && found->get<std::int64_t>() < 1) return std::nullopt;
  const auto format = found->get<std::uint64_t>();
  return format == 0 ? std::nullopt : std::optional(format);
}

Error newer_format(const std::filesystem::path& path, std::uint64_t format, int newest) {
  return invalid_argument(fmt::format(
      "{} was written by a newer version (format {}, this one reads up to {}): use that version",
      path.string(),
      format,
      newest));
}

}  // namespace opaline
