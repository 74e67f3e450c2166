#pragma once

#include <filesystem>
#include <optional>
#include <vector>

#include "base/files.h"
#include "base/result.h"
#include "capture/lamp_check.h"

namespace opaline::capture {

/// lamps.json of a session's directory: {"format": 1, "tried": 83, "dead": [12]}, so that a capture that goes on does not light every lamp again.
Result<void> write_lamp_check(FileOperations& files,
                              const std::filesystem::path& directory,
                              const LampCheck& check);
/// Its dead lamps; none where there is no such file, or a damaged one.
std::optional<std::vector<int>> read_lamp_check(const std::filesystem::path& directory);

}  // namespace opaline::capture
