#include "daemon/calibrate/view_frame.h"

#include <algorithm>
#include <chrono>

#include "base/io/image_io.h"

namespace opaline::daemon {
namespace {

constexpr double kFullShare = 0.98;

std::uint16_t square_mean(
    const Image<std::uint16_t>& picture, int left, int top, int side, int channel, double full) {
  unsigned sum = 0;
  unsigned count = 0;
  std::uint16_t most = 0;
  for (int y = top; y < std::min(top + side, picture.height()); ++y) {
    for (int x = left; x < std::min(left + side, picture.width()); ++x, ++count) {
      sum += picture.at(x, y, channel);
      most = std::max(most, picture.at(x, y, channel));
    }
  }
  return most >= full ? most : static_cast<std::uint16_t>(sum / std::max(count, 1u));
}

}  // namespace

Image<std::uint16_t> shrunk_codes(const Image<std::uint16_t>& picture, int widest, double full) {
  const int n = (picture.width() + widest - 1) / widest;
  if (n <= 1) return picture;
  Image<std::uint16_t> small(
      std::max(1, picture.width() / n), std::max(1, picture.height() / n), picture.channels());
  for (int y = 0; y < small.height(); ++y) {
    for (int x = 0; x < small.width(); ++x) {
      for (int c = 0; c < small.channels(); ++c)
        small.at(x, y, c) = square_mean(picture, n * x, n * y, n, c, full);
    }
  }
  return small;
}

Result<ViewFrame> view_of(const Frame& frame, double black, double clipping) {
  const auto figures = calibration::view_figures(frame.pixels, black, clipping);
  if (!figures) return figures.error();
  const double full = black + kFullShare * (clipping - black);
  const auto picture = calibration::view_picture(
      shrunk_codes(frame.pixels, kWidestView, full), black, clipping, *figures);
  auto png = encode_image({picture, {}, {}}, ImageFormat::kPng);
  if (!png) return png.error();
  return ViewFrame{*figures,
                   *std::move(png),
                   {{"exposure_s", std::chrono::duration<double>(frame.exposure).count()},
                    {"focus", figures->focus},
                    {"saturated", figures->saturated},
                    {"coverage", figures->lit},
                    {"brightest", figures->brightest},
                    {"histogram", figures->histogram}}};
}

}  // namespace opaline::daemon
