#pragma once

#include <cstdint>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>

#include "base/result.h"

namespace opaline {

/// The "format" of a JSON document, 1, 2, 3, ...; none when it has none, or no such number: damaged.
std::optional<std::uint64_t> format_of(const nlohmann::json& document);

/// What to say of a file whose format is above `newest`, the highest that this program reads. Such
/// a file is left alone.
Error newer_format(const std::filesystem::path& path, std::uint64_t format, int newest);

}  // namespace opaline
