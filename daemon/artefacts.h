#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "base/file_descriptor.h"
#include "base/result.h"
#include "base/session_directory.h"

namespace opaline::daemon {

/// A file of a session that may be downloaded.
struct Artefact {
  std::string name;  ///< relative to the session directory: "preview/shifted.png"
  std::uint64_t size = 0;
};

/// The session's regular files by name, at most `limit`. Hidden files, links, sockets and the lock
/// are none.
Result<std::vector<Artefact>> list_artefacts(const SessionDirectory& session,
                                             std::size_t limit = 20000);

struct OpenArtefact {
  FileDescriptor file;
  std::uint64_t size = 0;
  std::string content_type;
};

/// Opens an artefact by its name in the listing. The name is walked from the session's directory
/// piece by piece, and no piece may be hidden, "..", or a link. Errors: kNotFound.
Result<OpenArtefact> open_artefact(const SessionDirectory& session, std::string_view name);

}  // namespace opaline::daemon
