#include "calibration/viewfinder.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace opaline::calibration {
namespace {

constexpr double kSaturatedShare = 0.98;
constexpr double kLitShare = 0.05;
constexpr double kBrightestShare = 0.999;
constexpr int kStrip = 64;

double focus_of(const Image<std::uint16_t>& picture,
                double black,
                double lit,
                double noise_variance) {
  double squares = 0.0;
  double sum = 0.0;
  double count = 0.0;
  for (int y = 0; y + 2 < picture.height(); ++y) {
    for (int x = 0; x + 2 < picture.width(); ++x) {
      const double here = picture.at(x, y, 1) - black;
      if (here < lit) continue;
      const double right = picture.at(x + 2, y, 1) - black;
      const double below = picture.at(x, y + 2, 1) - black;
      squares += (right - here) * (right - here) + (below - here) * (below - here);
      sum += here;
      count += 1.0;
    }
  }
  if (!(count > 0.0)) return 0.0;
  const double mean = sum / count;
  return std::max(0.0, squares / count - 4.0 * noise_variance) / (mean * mean);
}

}  // namespace

Result<ViewFigures> view_figures(const Image<std::uint16_t>& picture,
                                 double black,
                                 double clipping,
                                 double noise_variance) {
  if (picture.channels() != 3 || picture.pixel_count() == 0 || !(clipping > black))
    return invalid_argument("viewfinder: expected a colour picture, and clipping above black");
  ViewFigures figures;
  const double range = clipping - black;
  const auto pixels = static_cast<double>(picture.pixel_count());
  std::vector<std::uint16_t> codes(picture.samples().begin(), picture.samples().end());
  for (std::size_t i = 0; i < picture.pixel_count(); ++i) {
    bool lit = false;
    for (std::size_t c = 0; c < 3; ++c) {
      const double share = (codes[3 * i + c] - black) / range;
      lit = lit || share > kLitShare;
      if (share >= kSaturatedShare) figures.saturated[c] += 1.0 / pixels;
      const double bin = std::clamp(share * ViewFigures::kBins, 0.0, ViewFigures::kBins - 1.0);
      figures.histogram[c][static_cast<std::size_t>(bin)] += 1.0 / pixels;
    }
    if (lit) figures.lit += 1.0 / pixels;
  }
  figures.focus = focus_of(picture, black, kLitShare * range, noise_variance);
  const auto place = codes.begin() + static_cast<std::ptrdiff_t>(
                                         kBrightestShare * static_cast<double>(codes.size() - 1));
  std::ranges::nth_element(codes, place);
  figures.brightest = (*place - black) / range;
  return figures;
}

Image<std::uint8_t> view_picture(const Image<std::uint16_t>& picture,
                                 double black,
                                 double clipping,
                                 const ViewFigures& figures) {
  Image<std::uint8_t> view(picture.width(), picture.height() + kStrip, 3, 24);
  for (int y = 0; y < picture.height(); ++y) {
    for (int x = 0; x < picture.width(); ++x) {
      bool full = false;
      for (int c = 0; c < 3; ++c) {
        const double share =
            std::clamp((picture.at(x, y, c) - black) / (clipping - black), 0.0, 1.0);
        full = full || share >= kSaturatedShare;
        view.at(x, y, c) =
            static_cast<std::uint8_t>(std::lround(255.0 * std::pow(share, 1.0 / 2.2)));
      }
      if (full) {
        view.at(x, y, 0) = view.at(x, y, 2) = 255;
        view.at(x, y, 1) = 0;
      }
    }
  }
  for (int c = 0; c < 3; ++c) {
    const auto& bins = figures.histogram[static_cast<std::size_t>(c)];
    const double most = std::max(std::ranges::max(bins), 1e-9);
    for (int x = 0; x < picture.width(); ++x) {
      const auto bin = static_cast<std::size_t>(x) * ViewFigures::kBins / picture.width();
      const int height = static_cast<int>(std::lround((kStrip - 2) * std::sqrt(bins[bin] / most)));
      for (int y = 0; y < height; ++y) view.at(x, picture.height() + kStrip - 1 - y, c) = 220;
    }
  }
  return view;
}

}  // namespace opaline::calibration
