#include "capture/gradient_object.h"

#include <fmt/format.h>

namespace opaline::capture {
namespace {

double channel_mean(const Image<float>& picture, int x, int y) {
  return (picture.at(x, y, 0) + picture.at(x, y, 1) + picture.at(x, y, 2)) / 3.0;
}

}  // namespace

Result<Image<std::uint8_t>> brighter_pixels(const HdrImage& constant, double share, double white) {
  const Image<float>& radiance = constant.radiance;
  Image<std::uint8_t> seen(radiance.width(), radiance.height(), 1);
  std::size_t count = 0;
  for (int y = 0; y < seen.height(); ++y)
    for (int x = 0; x < seen.width(); ++x) {
      const bool bright = channel_mean(radiance, x, y) > share * white;
      seen.at(x, y) = bright ? 1 : 0;
      count += bright ? 1 : 0;
    }
  if (count >= 100) return seen;
  return unavailable(fmt::format(
      "{} pixels are brighter than {:.3g} % of a white surface: is the object in the middle of "
      "the sphere, and are camera and lamps calibrated? (led_sphere.object_threshold)",
      count,
      100.0 * share));
}

double light_in(const HdrImage& hdr, const Image<std::uint8_t>& footprint) {
  double sum = 0.0;
  for (int y = 0; y < footprint.height(); ++y)
    for (int x = 0; x < footprint.width(); ++x)
      if (footprint.at(x, y) != 0 && hdr.mask.at(x, y) != 0)
        sum += channel_mean(hdr.radiance, x, y);
  return sum;
}

}  // namespace opaline::capture
