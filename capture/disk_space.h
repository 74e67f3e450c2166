#pragma once

#include <cstddef>
#include <cstdint>

#include "base/result.h"
#include "capture/sequence.h"

namespace opaline::capture {

/// Whether the disk of a capture's directory has room for what it has still to take: `needed` bytes for `missing` lights.
/// Errors: kUnavailable, saying how many bytes are needed and free, or that they cannot be told.
Result<void> require_space(const Workplace& work, std::uint64_t needed, std::size_t missing);

}  // namespace opaline::capture
