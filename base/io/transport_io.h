#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "base/files.h"
#include "base/result.h"
#include "base/transport_responses.h"

namespace opaline {

/// Responses as a file, "*.transport", three parts one after another:
///
///   "opaline transport 1\n"
///   one line of JSON: every field of TransportResponses except the pictures, and "payload_bytes"
///   the pictures, packed and deflated by zlib
///
/// then 64 hexadecimal digits and "\n": SHA-256 of all bytes before them.
///
/// Inflated, patch after patch: radiance as 32-bit IEEE little endian, row after row, channels
/// interleaved, then variance as 16-bit little-endian codes of its logarithm: 0 is 0, else 2^((code
/// - 1) / 256 - 140), 0.14 % at most off. Each picture's bytes are stored by significance (all
/// first bytes, all second bytes, ...), which deflates better.
///
/// Errors: kInvalidArgument for a file of another kind or version, cut short, damaged, inconsistent or impossible;
///         kNotFound; kUnavailable (disk).
Result<std::vector<std::byte>> encode_transport(const TransportResponses& responses);
Result<TransportResponses> decode_transport(std::span<const std::byte> bytes);

/// Written whole or not at all.
Result<void> write_transport(FileOperations& files,
                             const std::filesystem::path& path,
                             const TransportResponses& responses);
Result<TransportResponses> read_transport(const std::filesystem::path& path);

/// The checksum that a file ends with, 64 hexadecimal digits, which stands for its content; not compared with it.
Result<std::string> transport_checksum(const std::filesystem::path& path);

}  // namespace opaline
