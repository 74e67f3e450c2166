#include "render/edit/mask.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <type_traits>

#include "base/files.h"
#include "base/io/image_io.h"

namespace opaline::render {
namespace {

template <class Sample>
Image<float> brightness(const Image<Sample>& pixels) {
  double full = 1.0;
  if constexpr (std::is_integral_v<Sample>) full = std::numeric_limits<Sample>::max();
  const int colours = pixels.channels() >= 3 ? 3 : 1;
  Image<float> values(pixels.width(), pixels.height(), 1);
  for (int y = 0; y < pixels.height(); ++y) {
    for (int x = 0; x < pixels.width(); ++x) {
      double sum = 0.0;
      for (int c = 0; c < colours; ++c) sum += pixels.at(x, y, c);
      values.at(x, y, 0) = static_cast<float>(std::clamp(sum / (colours * full), 0.0, 1.0));
    }
  }
  return values;
}

}  // namespace

Result<Mask> Mask::read(const std::filesystem::path& file) {
  const auto text = read_text(file);
  if (!text) return text.error();
  const auto image = decode_image(std::as_bytes(std::span(*text)));
  if (!image) return image.error().in(file.string());
  return std::visit([](const auto& pixels) { return Mask(brightness(pixels)); }, image->pixels);
}

double Mask::at(double u, double v) const {
  if (!(u >= 0.0 && u <= 1.0 && v >= 0.0 && v <= 1.0)) return 0.0;
  const double x = std::clamp(u * values_.width() - 0.5, 0.0, values_.width() - 1.0);
  const double y = std::clamp(v * values_.height() - 0.5, 0.0, values_.height() - 1.0);
  const int i = static_cast<int>(x);
  const int j = static_cast<int>(y);
  const int right = std::min(i + 1, values_.width() - 1);
  const int below = std::min(j + 1, values_.height() - 1);
  const double a = x - i;
  const double b = y - j;
  return (1.0 - b) * ((1.0 - a) * values_.at(i, j, 0) + a * values_.at(right, j, 0)) +
         b * ((1.0 - a) * values_.at(i, below, 0) + a * values_.at(right, below, 0));
}

}  // namespace opaline::render
