#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "base/result.h"

namespace opaline::drivers {

/// One photograph of a replayed session.
struct Photograph {
  std::string file;  ///< name in the folder
  std::optional<std::uint64_t>
      pattern_id;       ///< shown during the exposure; 0 = lamp dark; none: known by its name
  std::string pattern;  ///< its name; may be empty where there is an id
  std::chrono::nanoseconds exposure{};  ///< as measured
  std::string sha256;                   ///< of the file, lower-case hex; empty: not checked
};

/// A folder of photographs as a camera: what index.toml in the folder says.
///
///     [camera]
///     model = "Canon 5D"        # for people
///     width = 256
///     height = 256
///     bit_depth = 12            # codes of the photographs run from 0 to 2^bit_depth - 1; 8-bit photographs need 8
///     codes_per_unit = 4095.0   # code = codes_per_unit x value, for EXR only
///
///     [projector]               # what patterns were made for; may be left out: 640 x 480, 33.333333 ms, 50 ms
///     width = 640
///     height = 480
///     frame_period_ms = 33.333333
///     latency_ms = 50
///
///     [[photograph]]            # once for each; 8- and 16-bit PNG and TIFF, DNG (its mosaic binned: half its columns and rows), EXR, JPEG; grey ones count for three channels
///     file = "region_0_0-1.png"
///     pattern = "region_0_0"    # what was shown, as the capture names it: "black", "region_ROW_COLUMN", "held_out_..."
///     pattern_id = 16           # or its number, which counts where both are given; 0 = lamp dark
///     exposure_s = 0.0333
///     sha256 = "..."            # may be left out
struct ReplayIndex {
  std::string model = "photographs";
  int width = 0;
  int height = 0;
  int bit_depth = 12;
  double codes_per_unit = 4095.0;
  int projector_width = 640;
  int projector_height = 480;
  std::chrono::nanoseconds frame_period{33'333'333};
  std::chrono::nanoseconds latency = std::chrono::milliseconds(50);
  std::vector<Photograph> photographs;
};

/// Reads FOLDER/index.toml. Errors: kNotFound when there is no such folder or index, kInvalidArgument with file, line
/// and what would be right.
Result<ReplayIndex> read_replay_index(const std::filesystem::path& folder);

}  // namespace opaline::drivers
