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

/// IEC 61966-2-1.
double srgb(double linear) {
  linear = std::clamp(linear, 0.0, 1.0);
  return linear <= 0.0031308 ? 12.92 * linear : 1.055 * std::pow(linear, 1.0 / 2.4) - 0.055;
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

}  // namespace

double white_point(const Image<float>& radiance, double quantile) {
  std::vector<float> brightest;
  for (int y = 0; y < radiance.height(); ++y) {
    for (int x = 0; x < radiance.width(); ++x) {
      float most = 0.0F;
      for (int c = 0; c < 3; ++c) most = std::max(most, radiance.at(x, y, c));
      if (most > 0.0F && std::isfinite(most)) brightest.push_back(most);
    }
  }
  if (brightest.empty()) return 1.0;
  const auto place =
      static_cast<std::ptrdiff_t>(quantile * static_cast<double>(brightest.size() - 1));
  std::nth_element(brightest.begin(), brightest.begin() + place, brightest.end());
  return brightest[static_cast<std::size_t>(place)];
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
      double difference = 0.0;
      for (int c = 0; c < 3; ++c) difference += (relit.at(x, y, c) - captured.at(x, y, c)) / 3.0;
      set(picture, x, y, counts.at(x, y) != 0 ? diverging(difference / range) : kGrey);
    }
  }
  return picture;
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
