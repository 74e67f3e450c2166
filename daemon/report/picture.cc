#include "daemon/report/picture.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

namespace opaline::daemon {
namespace {

using Color = std::array<double, 3>;

std::uint8_t code(double share) {
  return static_cast<std::uint8_t>(std::lround(255.0 * std::clamp(share, 0.0, 1.0)));
}

/// The stops of the report's diverging scale (plot.cc), -1 to 1.
Color diverging(double value) {
  constexpr std::array<Color, 7> kStops{Color{33, 102, 172},
                                        {103, 169, 207},
                                        {209, 229, 240},
                                        {247, 247, 247},
                                        {253, 219, 199},
                                        {239, 138, 98},
                                        {178, 24, 43}};
  const double place = (std::clamp(value, -1.0, 1.0) + 1.0) * 3.0;
  const int low = std::min(static_cast<int>(place), 5);
  const double share = place - low;
  Color color{};
  for (int c = 0; c < 3; ++c) {
    color[c] = ((1.0 - share) * kStops[low][c] + share * kStops[low + 1][c]) / 255.0;
  }
  return color;
}

void set(Image<std::uint8_t>& picture, int x, int y, const Color& color) {
  for (int c = 0; c < 3; ++c) picture.at(x, y, c) = code(color[c]);
}

/// Of at least one value.
double quantile_of(std::vector<float>& values, double share) {
  const auto place = static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), values.begin() + place, values.end());
  return values[static_cast<std::size_t>(place)];
}

float mean_difference(const Image<float>& a, const Image<float>& b, int x, int y) {
  float sum = 0.0F;
  for (int c = 0; c < 3; ++c) sum += a.at(x, y, c) - b.at(x, y, c);
  return sum / 3.0F;
}

}  // namespace

double srgb(double linear) {
  linear = std::clamp(linear, 0.0, 1.0);
  return linear <= 0.0031308 ? 12.92 * linear : 1.055 * std::pow(linear, 1.0 / 2.4) - 0.055;
}

double white_point(const Image<float>& radiance, double quantile) {
  std::vector<float> brightest;
  for (int y = 0; y < radiance.height(); ++y) {
    for (int x = 0; x < radiance.width(); ++x) {
      float most = 0.0F;
      for (int c = 0; c < 3; ++c) most = std::max(most, radiance.at(x, y, c));
      if (most > 0.0F && std::isfinite(most)) brightest.push_back(most);
    }
  }
  return brightest.empty() ? 1.0 : quantile_of(brightest, quantile);
}

Image<std::uint8_t> tone_mapped(const Image<float>& radiance, double white) {
  Image<std::uint8_t> picture(radiance.width(), radiance.height(), 3);
  for (int y = 0; y < radiance.height(); ++y) {
    for (int x = 0; x < radiance.width(); ++x) {
      Color color{};
      for (int c = 0; c < 3; ++c) color[c] = srgb(radiance.at(x, y, c) / white);
      set(picture, x, y, color);
    }
  }
  return picture;
}

Image<std::uint8_t> difference_picture(const Image<float>& relit,
                                       const Image<float>& captured,
                                       const Image<std::uint8_t>& counts,
                                       double range) {
  constexpr Color kGrey{0.5, 0.5, 0.5};
  Image<std::uint8_t> picture(relit.width(), relit.height(), 3);
  for (int y = 0; y < relit.height(); ++y) {
    for (int x = 0; x < relit.width(); ++x) {
      const double difference = mean_difference(relit, captured, x, y);
      set(picture, x, y, counts.at(x, y) != 0 ? diverging(difference / range) : kGrey);
    }
  }
  return picture;
}

double difference_size(const Image<float>& relit,
                       const Image<float>& captured,
                       const Image<std::uint8_t>& counts,
                       double quantile) {
  std::vector<float> sizes;
  for (int y = 0; y < counts.height(); ++y) {
    for (int x = 0; x < counts.width(); ++x) {
      if (counts.at(x, y) != 0) sizes.push_back(std::abs(mean_difference(relit, captured, x, y)));
    }
  }
  return sizes.empty() ? 0.0 : quantile_of(sizes, quantile);
}

void mark(Image<std::uint8_t>& picture, const Image<std::uint8_t>& marks) {
  for (int y = 0; y < picture.height(); ++y) {
    for (int x = 0; x < picture.width(); ++x) {
      if (marks.at(x, y) != 0) set(picture, x, y, {1.0, 0.0, 1.0});
    }
  }
}

Image<float> reduced(const Image<float>& picture, int factor) {
  Image<float> small(picture.width() / factor, picture.height() / factor, picture.channels());
  const float share = 1.0F / static_cast<float>(factor * factor);
  for (int y = 0; y < small.height() * factor; ++y) {
    for (int x = 0; x < small.width() * factor; ++x) {
      for (int c = 0; c < picture.channels(); ++c) {
        small.at(x / factor, y / factor, c) += share * picture.at(x, y, c);
      }
    }
  }
  return small;
}

Image<std::uint8_t> reduced_marks(const Image<std::uint8_t>& marks, int factor) {
  Image<std::uint8_t> small(marks.width() / factor, marks.height() / factor, 1);
  for (int y = 0; y < small.height() * factor; ++y) {
    for (int x = 0; x < small.width() * factor; ++x) {
      if (marks.at(x, y) != 0) small.at(x / factor, y / factor) = 1;
    }
  }
  return small;
}

double round_up(double value) {
  if (!(value > 0.0)) return 1.0;
  const double decade = std::pow(10.0, std::floor(std::log10(value)));
  for (const double step : {1.0, 2.0, 5.0}) {
    if (value <= step * decade * (1.0 + 1e-9)) return step * decade;
  }
  return 10.0 * decade;
}

}  // namespace opaline::daemon
