#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "base/files.h"
#include "base/result.h"
#include "base/session_directory.h"

namespace opaline::daemon {

/// "20260131-123456-ab12cd-marble": when (UTC), six random digits, and what of the name can stand
/// in a file's name. Sorts by time.
std::string new_session_id(std::string_view name);

/// Whether a text from outside can be a session's id: lower-case letters, digits and hyphens, at
/// most 80.
bool is_session_id(std::string_view text);

/// Makes a session in `root`, whole or not at all: it is written under a hidden name and renamed.
Result<SessionDirectory> make_session(FileOperations& files,
                                      const std::filesystem::path& root,
                                      const SessionDirectory::Contents& contents);

/// Makes a session's directory no session any more, under a hidden name that it returns, to be
/// removed. kBusy while a job works on it.
Result<std::filesystem::path> hide_session(FileOperations& files, const SessionDirectory& session);

/// What an interrupted make_session left in `root`, and what was hidden and not removed.
std::vector<std::filesystem::path> leftovers_in(const std::filesystem::path& root);

}  // namespace opaline::daemon
