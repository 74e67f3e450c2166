#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "capture/hdr_merge.h"

namespace opaline::capture {
namespace {

constexpr double kDeviations = 8.0;

// Of the up to eight neighbours, in codes.
double neighbours_median(const Image<std::uint16_t>& frame, int x, int y, int channel) {
  std::array<std::uint16_t, 8> codes{};
  std::size_t count = 0;
  for (int dy = -1; dy <= 1; ++dy) {
    for (int dx = -1; dx <= 1; ++dx) {
      const int nx = x + dx;
      const int ny = y + dy;
      const bool inside = nx >= 0 && ny >= 0 && nx < frame.width() && ny < frame.height();
      if (inside && (dx != 0 || dy != 0)) codes[count++] = frame.at(nx, ny, channel);
    }
  }
  if (count == 0) return frame.at(x, y, channel);
  const auto middle = codes.begin() + static_cast<std::ptrdiff_t>(count / 2);
  std::nth_element(codes.begin(), middle, codes.begin() + static_cast<std::ptrdiff_t>(count));
  return *middle;
}

bool stands_out(
    const CameraCalibration& camera, const Image<std::uint16_t>& frame, int x, int y, int channel) {
  const Electrons own = electrons_from_code(camera, frame.at(x, y, channel));
  const Electrons around = electrons_from_code(camera, neighbours_median(frame, x, y, channel));
  const double read = camera.read_noise_electrons;
  const double quantisation = around.per_code;
  const double variance =
      std::max(around.signal, 0.0) + read * read + quantisation * quantisation / 12.0;
  return own.signal - around.signal > kDeviations * std::sqrt(variance) + quantisation;
}

void mark(const CameraCalibration& camera,
          const Image<std::uint16_t>& frame,
          Image<std::uint8_t>& hot) {
  for (int y = 0; y < hot.height(); ++y) {
    for (int x = 0; x < hot.width(); ++x) {
      for (int c = 0; c < frame.channels(); ++c) {
        if (stands_out(camera, frame, x, y, c)) hot.at(x, y) = 1;
      }
    }
  }
}

}  // namespace

Image<std::uint8_t> find_hot_pixels(const CameraCalibration& camera,
                                    std::span<const Image<std::uint16_t>* const> black_frames) {
  Image<std::uint8_t> hot(camera.model.width, camera.model.height, 1);
  for (const auto& [x, y] : camera.hot_pixels) {
    if (x >= 0 && y >= 0 && x < hot.width() && y < hot.height()) hot.at(x, y) = 1;
  }
  for (const Image<std::uint16_t>* frame : black_frames) mark(camera, *frame, hot);
  return hot;
}

}  // namespace opaline::capture
