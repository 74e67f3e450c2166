#pragma once

#include <filesystem>

#include "base/file_descriptor.h"
#include "base/result.h"

namespace opaline {

/// Unix stream sockets on paths of any length (the kernel's own limit is 107 bytes): the directory
/// is opened first and named through /proc/self/fd.

/// Listens at `path`, for this user only, in place of a socket that lies there; non-blocking.
/// The caller knows that nobody serves the old one. Errors: kUnavailable.
Result<FileDescriptor> listen_unix(const std::filesystem::path& path);

/// Connects, blocking. Errors: kUnavailable when nobody listens there.
Result<FileDescriptor> connect_unix(const std::filesystem::path& path);

}  // namespace opaline
