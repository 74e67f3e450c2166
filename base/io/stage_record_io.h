#pragma once

#include <filesystem>

#include "base/files.h"
#include "base/result.h"
#include "base/stage_record.h"

namespace opaline {

inline constexpr int kStageRecordFormat = 1;

/// DIRECTORY/light_stage.json: format version, lights, how the pictures lie, the patterns in order. Written after the pictures it names, and
/// whole. Errors: kUnavailable.
Result<void> write_stage_record(FileOperations& files,
                                const std::filesystem::path& directory,
                                const StageRecord& record);

/// Errors: kNotFound when there is none; kInvalidArgument when a newer version wrote it, or when it is damaged.
Result<StageRecord> read_stage_record(const std::filesystem::path& directory);

}  // namespace opaline
