#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace opaline::support {

/// What a DNG is made of; the tags that its specification (1.4) asks for are added.
struct DngOptions {
  int width = 0;  ///< of the picture, with what lies beside the active area
  int height = 0;
  std::vector<std::uint16_t> codes = {};  ///< row by row; three a pixel of LinearRaw
  bool linear_raw = false;
  std::array<std::uint8_t, 4> pattern{0, 1, 1, 2};  ///< of the active area
  std::array<std::uint32_t, 4> active{};            ///< top, left, bottom, right; all 0: everything
  std::uint16_t orientation = 1;
  bool big_endian = false;
  bool behind_preview = false;  ///< in a sub-directory, after a small picture to look at
};

/// A DNG of 16-bit samples, uncompressed, black level 64, white level 4095, written down anew from the specification.
std::vector<std::byte> make_dng(const DngOptions& options);

}  // namespace opaline::support
