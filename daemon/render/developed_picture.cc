#include "daemon/render/developed_picture.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "daemon/report/picture.h"

namespace opaline::daemon {
namespace {

constexpr double kQuantile = 0.995;

using render::PictureOptions;

/// One pixel as a display shows it, linear and 0 to 1, and its alpha.
std::array<double, 4> shown(
    const Image<float>& radiance, int x, int y, double gain, const PictureOptions& picture) {
  const double covered = radiance.at(x, y, 3);
  std::array<double, 4> pixel{0.0, 0.0, 0.0, picture.transparent ? covered : 1.0};
  for (int c = 0; c < 3; ++c) {
    const double light = gain * radiance.at(x, y, c);
    if (picture.transparent) {
      pixel[c] = covered > 0.0 ? light / covered : 0.0;
    } else {
      pixel[c] = std::min(light, covered) + (1.0 - covered) * picture.background[c];
    }
  }
  return pixel;
}

template <class Sample>
Image<Sample> display_codes(const Image<float>& radiance,
                            double white,
                            const PictureOptions& picture) {
  constexpr double kFull = std::numeric_limits<Sample>::max();
  const double gain = std::exp2(picture.exposure) / white;
  Image<Sample> image(radiance.width(), radiance.height(), picture.transparent ? 4 : 3);
  for (int y = 0; y < image.height(); ++y) {
    for (int x = 0; x < image.width(); ++x) {
      const auto pixel = shown(radiance, x, y, gain, picture);
      for (int c = 0; c < image.channels(); ++c) {
        const double code = c < 3 ? srgb(pixel[c]) : pixel[c];
        image.at(x, y, c) = static_cast<Sample>(std::lround(kFull * std::clamp(code, 0.0, 1.0)));
      }
    }
  }
  return image;
}

}  // namespace

double white_of(const Image<float>& radiance, const PictureOptions& picture) {
  if (picture.white > 0.0) return picture.white;
  Image<float> light(radiance.width(), radiance.height(), 3);
  for (int y = 0; y < light.height(); ++y) {
    for (int x = 0; x < light.width(); ++x) {
      for (int c = 0; c < 3; ++c) light.at(x, y, c) = radiance.at(x, y, c);
    }
  }
  return white_point(light, kQuantile);
}

Image<std::uint8_t> displayed(const Image<float>& radiance,
                              double white,
                              const PictureOptions& picture) {
  return display_codes<std::uint8_t>(radiance, white, picture);
}

Result<std::vector<std::byte>> developed(const Image<float>& radiance,
                                         double white,
                                         const PictureOptions& picture,
                                         ImageFormat format) {
  ImageFile file;
  if (format == ImageFormat::kExr) {
    file.pixels = radiance;
  } else if (format == ImageFormat::kTiff) {
    file.pixels = display_codes<std::uint16_t>(radiance, white, picture);
  } else {
    file.pixels = displayed(radiance, white, picture);
  }
  return encode_image(file, format);
}

}  // namespace opaline::daemon
