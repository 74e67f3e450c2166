#pragma once

#include <filesystem>

#include "base/image.h"
#include "base/result.h"

namespace opaline::render {

/// A picture that says where a brush takes, and how much: 0 to 1.
class Mask {
 public:
  /// The mean of a pixel's red, green and blue, as stored, over what the file can hold; of EXR the value itself, clamped.
  /// Errors: kNotFound, and kInvalidArgument for what is no picture.
  static Result<Mask> read(const std::filesystem::path& file);
  explicit Mask(Image<float> values) : values_(std::move(values)) {}

  /// Bilinear at (u, v), both 0 to 1 over the picture, the top row first; 0 beyond it.
  double at(double u, double v) const;

 private:
  Image<float> values_;
};

}  // namespace opaline::render
