#pragma once

#include <filesystem>
#include <string>

#include "base/files.h"
#include "base/result.h"
#include "base/session_directory.h"
#include "config/session_config.h"

namespace opaline::daemon {

/// preview/object.toml: a scene (docs/rendering.md) with an object of the session's material, which the preview draws, and
/// "opaline render" and "opaline view" open as any other.
std::filesystem::path object_scene_file(const SessionDirectory& session);

/// Its text. The shape named in `preview.object`, as large as the shorter side of the seen face, is cut from the middle of
/// material.vdb, mirrored beyond it, its own z towards the block's z_max; it stands on a floor, lit from behind and from
/// above. It mirrors nothing, since that was not measured, unless the session has its surface's reflectance.
std::string object_scene(const SessionDirectory& session, const config::SessionConfig& config);

/// Writes it where there is none.
Result<void> write_object_scene(FileOperations& files,
                                const SessionDirectory& session,
                                const config::SessionConfig& config);

}  // namespace opaline::daemon
