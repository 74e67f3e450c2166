#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "base/files.h"
#include "base/frame.h"
#include "base/result.h"
#include "drivers/projector.h"

namespace opaline::capture {

/// One accepted frame and what was asked for.
struct CapturedFrame {
  std::size_t exposure_index = 0;  ///< in the ladder of exposures
  std::chrono::nanoseconds exposure_asked{};
  Frame frame;
};

/// The exposures asked for, summed, s.
double seconds_asked(std::span<const CapturedFrame> frames);

/// What lies on disk of one light.
struct StoredLight {
  std::vector<CapturedFrame> frames;  ///< none: never captured wholly, of another pattern, damaged
  std::string damage;                 ///< what is wrong with which file; empty: nothing
};

/// The raw frames of a session on disk:
///
///   LIGHT/INDEX-MILLISECONDSms.png   16-bit, the camera's codes; -2, -3, ... for frames of the same exposure
///   LIGHT/index.json                 written last: format version, identity of the pattern; per
///                                    frame pattern, trigger count, times, exposure, and the
///                                    SHA-256 of pixels and file
///
/// So a light is there wholly, or is taken again.
class FrameStore {
 public:
  /// `files` outlives us.
  FrameStore(FileOperations& files, std::filesystem::path directory)
      : files_(files), directory_(std::move(directory)) {}

  Result<void> save(const std::string& light,
                    const drivers::Pattern& pattern,
                    std::span<const CapturedFrame> frames);
  /// Every frame of this pattern, each checked against its SHA-256.
  /// Errors: kInvalidArgument when a newer version wrote them: not to be taken again.
  Result<StoredLight> load(const std::string& light, const drivers::Pattern& pattern) const;
  /// Whether the light was captured wholly, as far as names tell.
  bool has(const std::string& light) const;
  const std::filesystem::path& directory() const { return directory_; }

 private:
  FileOperations& files_;
  std::filesystem::path directory_;
};

}  // namespace opaline::capture
