#include "daemon/calibrate/pose_picture.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace opaline::daemon {
namespace {

using Color = std::array<std::uint8_t, 3>;
constexpr Color kFound{40, 230, 90};
constexpr Color kFirst{255, 210, 40};
constexpr Color kUncovered{230, 60, 50};
constexpr int kArm = 5;
constexpr int kRing = 7;
constexpr int kGap = 4;

void dot(Image<std::uint8_t>& picture, int x, int y, const Color& color) {
  if (x < 0 || y < 0 || x >= picture.width() || y >= picture.height()) return;
  for (int c = 0; c < 3; ++c) picture.at(x, y, c) = color[static_cast<std::size_t>(c)];
}

void cross(Image<std::uint8_t>& picture, int x, int y, const Color& color) {
  for (int i = -kArm; i <= kArm; ++i) {
    dot(picture, x + i, y, color);
    dot(picture, x, y + i, color);
  }
}

void ring(Image<std::uint8_t>& picture, int x, int y, const Color& color) {
  for (int i = 0; i < 64; ++i) {
    const double angle = i * 0.0981747704;
    dot(picture,
        x + static_cast<int>(std::lround(kRing * std::cos(angle))),
        y + static_cast<int>(std::lround(kRing * std::sin(angle))),
        color);
  }
}

void frame(Image<std::uint8_t>& picture, int left, int top, int right, int bottom) {
  for (int x = left; x <= right; x += 2) {
    dot(picture, x, top, kUncovered);
    dot(picture, x, bottom, kUncovered);
  }
  for (int y = top; y <= bottom; y += 2) {
    dot(picture, left, y, kUncovered);
    dot(picture, right, y, kUncovered);
  }
}

void mark_uncovered(Image<std::uint8_t>& picture, const calibration::PoseGuide& guide) {
  constexpr int kAcross = calibration::PoseGuide::kAcross;
  constexpr int kDown = calibration::PoseGuide::kDown;
  for (int j = 0; j < kDown; ++j) {
    for (int i = 0; i < kAcross; ++i) {
      if (guide.fields[static_cast<std::size_t>(j * kAcross + i)] > 0) continue;
      frame(picture,
            picture.width() * i / kAcross + 1,
            picture.height() * j / kDown + 1,
            picture.width() * (i + 1) / kAcross - 2,
            picture.height() * (j + 1) / kDown - 2);
    }
  }
}

}  // namespace

Image<std::uint8_t> shrunk(const Image<std::uint8_t>& picture, int widest) {
  const int n = (picture.width() + widest - 1) / widest;
  if (n <= 1) return picture;
  Image<std::uint8_t> small(
      std::max(1, picture.width() / n), std::max(1, picture.height() / n), picture.channels());
  for (int y = 0; y < small.height(); ++y) {
    for (int x = 0; x < small.width(); ++x) {
      for (int c = 0; c < small.channels(); ++c) {
        int sum = 0;
        int count = 0;
        for (int j = n * y; j < std::min(n * (y + 1), picture.height()); ++j) {
          for (int i = n * x; i < std::min(n * (x + 1), picture.width()); ++i, ++count)
            sum += picture.at(i, j, c);
        }
        small.at(x, y, c) = static_cast<std::uint8_t>((sum + count / 2) / count);
      }
    }
  }
  return small;
}

Image<std::uint8_t> pose_picture(const Image<std::uint8_t>& grey,
                                 const calibration::BoardView& board,
                                 const calibration::PoseGuide& guide,
                                 int widest) {
  const Image<std::uint8_t> small = shrunk(grey, widest);
  Image<std::uint8_t> picture(small.width(), small.height(), 3);
  for (std::size_t i = 0; i < picture.samples().size(); ++i)
    picture.samples()[i] = small.samples()[i / 3];
  mark_uncovered(picture, guide);
  const double scale = static_cast<double>(small.width()) / grey.width();
  for (const calibration::BoardCorner& corner : board.corners) {
    const int x = static_cast<int>(corner.pixel.x * scale);
    const int y = static_cast<int>(corner.pixel.y * scale);
    cross(picture, x, y, kFound);
    if (corner.id == 0) ring(picture, x, y, kFirst);
  }
  return picture;
}

Image<std::uint8_t> contact_sheet(const std::vector<Image<std::uint8_t>>& pictures, int columns) {
  if (pictures.empty()) return {};
  const int count = static_cast<int>(pictures.size());
  const int across = std::min(columns, count);
  const int rows = (count + across - 1) / across;
  const int width = pictures.front().width() + kGap;
  const int height = pictures.front().height() + kGap;
  Image<std::uint8_t> sheet(across * width - kGap, rows * height - kGap, 3, 255);
  for (int p = 0; p < count; ++p) {
    const Image<std::uint8_t>& picture = pictures[static_cast<std::size_t>(p)];
    for (int y = 0; y < std::min(picture.height(), height - kGap); ++y) {
      for (int x = 0; x < std::min(picture.width(), width - kGap); ++x) {
        for (int c = 0; c < 3; ++c)
          sheet.at(p % across * width + x, p / across * height + y, c) = picture.at(x, y, c);
      }
    }
  }
  return sheet;
}

}  // namespace opaline::daemon
