#pragma once

#include <chrono>
#include <filesystem>
#include <stop_token>

#include "base/file_descriptor.h"
#include "base/result.h"

namespace opaline {

/// Unix stream sockets on paths of any length (the kernel's own limit is 107 bytes): the directory
/// is opened first and named through /proc/self/fd.

/// Listens at `path`, for this user only, in place of a socket that lies there; non-blocking.
/// The caller knows that nobody serves the old one. Errors: kInvalidArgument when something else
/// than a socket lies there, which is left alone; kUnavailable.
Result<FileDescriptor> listen_unix(const std::filesystem::path& path);

/// Connects; the descriptor is blocking. A server that does not take its connections (stopped, hung)
/// keeps us waiting, for `patience` at most.
/// Errors: kUnavailable when nobody listens there; kTimeout; kCancelled.
Result<FileDescriptor> connect_unix(const std::filesystem::path& path,
                                    std::chrono::nanoseconds patience = std::chrono::seconds(2),
                                    std::stop_token stop = {});

}  // namespace opaline
