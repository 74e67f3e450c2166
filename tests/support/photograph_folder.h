#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

namespace opaline::support {

/// Writes a folder of photographs of 8 x 6 pixels with its index, as a ReplayCamera reads them: patterns 1, 2 and 3 and
/// the dark, each 100 ms and 1 s long; 12-bit codes, kept in PNG (16-bit), TIFF and EXR.
void write_photographs(const std::filesystem::path& folder);

/// The code of a pixel of those photographs.
std::uint16_t photograph_code(std::uint64_t pattern, bool long_exposure, int x, int y, int channel);

}  // namespace opaline::support
