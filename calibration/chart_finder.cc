#include "calibration/chart_finder.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/mcc.hpp>

namespace opaline::calibration {
namespace {

constexpr double kMiddle = 0.15;  // of a patch's distance to the next, to either side of its middle
constexpr double kBright = 0.995;
constexpr double kDisplayGamma = 1.0 / 2.2;  // mcc expects pictures as they are shown
constexpr int kFewestPixels = 9;

using Corners = std::array<std::array<double, 2>, 4>;

// As it would be shown: the brightest samples are 255, each channel to itself, so that the lamp's white is about grey.
cv::Mat shown(const Image<std::uint16_t>& picture, double black) {
  std::array<double, 3> bright{};
  for (std::size_t c = 0; c < 3; ++c) {
    std::vector<std::uint16_t> codes;
    for (std::size_t i = c; i < picture.samples().size(); i += 3)
      codes.push_back(picture.samples()[i]);
    const auto place = codes.begin() +
                       static_cast<std::ptrdiff_t>(kBright * static_cast<double>(codes.size() - 1));
    std::ranges::nth_element(codes, place);
    bright[c] = std::max(1.0, *place - black);
  }
  cv::Mat bgr(picture.height(), picture.width(), CV_8UC3);
  for (int y = 0; y < picture.height(); ++y) {
    for (int x = 0; x < picture.width(); ++x) {
      for (int c = 0; c < 3; ++c) {
        const double light = std::clamp(
            (picture.at(x, y, c) - black) / bright[static_cast<std::size_t>(c)], 0.0, 1.0);
        bgr.at<cv::Vec3b>(y, x)[2 - c] =
            static_cast<std::uint8_t>(std::lround(255.0 * std::pow(light, kDisplayGamma)));
      }
    }
  }
  return bgr;
}

// mcc gives up on charts that are small; enlarged they are found.
std::optional<Corners> outline_of(const cv::Mat& bgr) {
  for (const double scale : {1.0, 2.0, 4.0, 0.5}) {
    if (scale * std::max(bgr.rows, bgr.cols) > 4000.0) continue;
    cv::Mat scaled;
    cv::resize(bgr, scaled, {}, scale, scale, scale < 1.0 ? cv::INTER_AREA : cv::INTER_LINEAR);
    const auto detector = cv::mcc::CCheckerDetector::create();
    if (!detector->process(scaled, cv::mcc::MCC24, 1)) continue;
    const auto best = detector->getBestColorChecker();
    if (best == nullptr || best->getBox().size() != 4) continue;
    Corners corners{};
    for (std::size_t i = 0; i < 4; ++i)
      corners[i] = {best->getBox()[i].x / scale, best->getBox()[i].y / scale};
    return corners;
  }
  return std::nullopt;
}

cv::Matx33d picture_from_chart(const Corners& corners) {
  const std::array<cv::Point2f, 4> chart{
      cv::Point2f{0, 0}, {kCheckerColumns, 0}, {kCheckerColumns, kCheckerRows}, {0, kCheckerRows}};
  std::array<cv::Point2f, 4> picture;
  for (std::size_t i = 0; i < 4; ++i)
    picture[i] = {static_cast<float>(corners[i][0]), static_cast<float>(corners[i][1])};
  return cv::Matx33d(cv::getPerspectiveTransform(chart.data(), picture.data()));
}

struct Patch {
  CameraRgb mean{};
  double clipped = 0.0;
  int pixels = 0;
};

Patch measure_patch(const Image<std::uint16_t>& picture,
                    const cv::Matx33d& from_chart,
                    double u,
                    double v,
                    double black,
                    double clipping) {
  std::vector<cv::Point2d> corners;
  for (const auto& [du, dv] : {std::pair{-kMiddle, -kMiddle},
                               {kMiddle, -kMiddle},
                               {kMiddle, kMiddle},
                               {-kMiddle, kMiddle}}) {
    const cv::Vec3d p = from_chart * cv::Vec3d(u + du, v + dv, 1.0);
    corners.emplace_back(p[0] / p[2], p[1] / p[2]);
  }
  const cv::Matx33d to_chart = from_chart.inv();
  const auto [left, right] = std::ranges::minmax(corners, {}, &cv::Point2d::x);
  const auto [top, bottom] = std::ranges::minmax(corners, {}, &cv::Point2d::y);
  Patch patch;
  for (int y = std::max(0, static_cast<int>(top.y));
       y <= std::min(picture.height() - 1, static_cast<int>(bottom.y));
       ++y) {
    for (int x = std::max(0, static_cast<int>(left.x));
         x <= std::min(picture.width() - 1, static_cast<int>(right.x));
         ++x) {
      const cv::Vec3d p = to_chart * cv::Vec3d(x + 0.5, y + 0.5, 1.0);
      if (std::abs(p[0] / p[2] - u) > kMiddle || std::abs(p[1] / p[2] - v) > kMiddle) continue;
      ++patch.pixels;
      bool full = false;
      for (int c = 0; c < 3; ++c) {
        patch.mean[static_cast<std::size_t>(c)] += picture.at(x, y, c) - black;
        full = full || picture.at(x, y, c) >= clipping;
      }
      patch.clipped += full ? 1.0 : 0.0;
    }
  }
  for (double& m : patch.mean) m /= std::max(1, patch.pixels);
  patch.clipped /= std::max(1, patch.pixels);
  return patch;
}

FoundChart measured(const Image<std::uint16_t>& picture,
                    const Corners& corners,
                    double black,
                    double clipping) {
  FoundChart chart;
  chart.corners = corners;
  chart.smallest_px = std::numeric_limits<int>::max();
  const cv::Matx33d from_chart = picture_from_chart(corners);
  for (int row = 0; row < kCheckerRows; ++row) {
    for (int column = 0; column < kCheckerColumns; ++column) {
      const auto place = static_cast<std::size_t>(row) * kCheckerColumns + column;
      const Patch patch =
          measure_patch(picture, from_chart, column + 0.5, row + 0.5, black, clipping);
      chart.patches[place] = patch.mean;
      chart.clipped[place] = patch.clipped;
      chart.smallest_px = std::min(chart.smallest_px, patch.pixels);
    }
  }
  return chart;
}

// How far from the references the best matrix leaves the patches; a swap of channels is no matter to it.
double misfit(const FoundChart& chart) {
  std::vector<Lab> references;
  for (const ColorCheckerPatch& patch : kColorChecker) references.push_back(patch.lab);
  const auto fit = fit_color(ColorModel::kMatrix, {1.0, 1.0, 1.0}, chart.patches, references);
  if (!fit) return std::numeric_limits<double>::infinity();
  double sum = 0.0;
  for (std::size_t p = 0; p < references.size(); ++p)
    sum += delta_e_2000(lab_from_xyz(fit->xyz(chart.patches[p])), references[p]);
  return sum;
}

double side(const Corners& c, std::size_t from, std::size_t to) {
  return std::hypot(c[to][0] - c[from][0], c[to][1] - c[from][1]);
}

}  // namespace

Result<std::optional<FoundChart>> find_chart(const Image<std::uint16_t>& picture,
                                             double black,
                                             double clipping) {
  if (picture.channels() != 3 || picture.width() < 24 || picture.height() < 16)
    return invalid_argument("colour chart: expected a colour picture of 24 x 16 pixels or more");
  try {
    auto corners = outline_of(shown(picture, black));
    if (!corners) return std::optional<FoundChart>();
    // The long side is that of six patches.
    if (side(*corners, 0, 1) + side(*corners, 2, 3) < side(*corners, 1, 2) + side(*corners, 3, 0))
      std::rotate(corners->begin(), corners->begin() + 1, corners->end());
    FoundChart upright = measured(picture, *corners, black, clipping);
    std::rotate(corners->begin(), corners->begin() + 2, corners->end());
    FoundChart turned = measured(picture, *corners, black, clipping);
    FoundChart& best = misfit(upright) <= misfit(turned) ? upright : turned;
    if (best.smallest_px < kFewestPixels) return std::optional<FoundChart>();
    return std::optional(best);
  } catch (const cv::Exception& e) {
    return internal_error(std::string("colour chart: ") + e.what());
  }
}

}  // namespace opaline::calibration
