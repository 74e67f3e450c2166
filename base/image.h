#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "base/ensure.h"

namespace opaline {

/// A picture in memory: height x width pixels of `channels` interleaved samples, row-major, top row
/// first. The centre of pixel (x, y) lies at (x + 0.5, y + 0.5).
template <class T>
class Image {
 public:
  Image() = default;
  Image(int width, int height, int channels, T fill = {})
      : width_(width),
        height_(height),
        channels_(channels),
        samples_(static_cast<std::size_t>(width) * height * channels, fill) {
    ENSURE(width >= 0 && height >= 0 && channels >= 1);
  }

  int width() const { return width_; }
  int height() const { return height_; }
  int channels() const { return channels_; }
  bool empty() const { return samples_.empty(); }
  std::size_t pixel_count() const { return static_cast<std::size_t>(width_) * height_; }

  T& at(int x, int y, int channel = 0) { return samples_[index(x, y, channel)]; }
  const T& at(int x, int y, int channel = 0) const { return samples_[index(x, y, channel)]; }

  std::span<T> samples() { return samples_; }
  std::span<const T> samples() const { return samples_; }
  bool operator==(const Image&) const = default;

 private:
  std::size_t index(int x, int y, int channel) const {
    return (static_cast<std::size_t>(y) * width_ + x) * channels_ + channel;
  }
  int width_ = 0;
  int height_ = 0;
  int channels_ = 1;
  std::vector<T> samples_;
};

}  // namespace opaline
