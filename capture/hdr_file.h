#pragma once

#include <cstddef>
#include <filesystem>
#include <vector>

#include "base/files.h"
#include "base/result.h"
#include "capture/hdr_merge.h"

namespace opaline::capture {

/// An HDR picture as EXR, float32, camera pixels: R G B radiance in W/(mm^2 sr); var.R var.G var.B
/// its variance; mask and saturated, 0 or 1. The same picture gives the same bytes.
Result<std::vector<std::byte>> encode_hdr(const HdrImage& hdr);
Result<HdrImage> read_hdr(const std::filesystem::path& path);

/// Writes the picture whole; leaves a file alone that holds these bytes already.
Result<void> write_hdr(FileOperations& files,
                       const std::filesystem::path& path,
                       const HdrImage& hdr);

}  // namespace opaline::capture
