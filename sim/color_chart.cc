#include "sim/color_chart.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>

namespace opaline::sim {
namespace {

constexpr Eigen::Index kBands = 31;
constexpr double kLeast = 0.005;
constexpr double kMost = 0.98;
constexpr int kSamples = 4;  // of a pixel, each way
constexpr std::size_t kFrame = 24;
constexpr std::size_t kWall = 25;

double nanometres(Eigen::Index band) { return 400.0 + 10.0 * static_cast<double>(band); }

double lobe(double x, double middle, double below, double above) {
  const double z = (x - middle) / (x < middle ? below : above);
  return std::exp(-0.5 * z * z);
}

// Colour matching functions by Wyman et al., Eq. 4.
std::array<double, 3> observer(double nm) {
  return {1.056 * lobe(nm, 599.8, 37.9, 31.0) + 0.362 * lobe(nm, 442.0, 16.0, 26.7) -
              0.065 * lobe(nm, 501.1, 20.4, 26.2),
          0.821 * lobe(nm, 568.8, 46.9, 40.5) + 0.286 * lobe(nm, 530.9, 16.3, 31.1),
          1.217 * lobe(nm, 437.0, 11.8, 36.0) + 0.681 * lobe(nm, 459.0, 26.0, 13.8)};
}

double planck(double nm, double kelvin) {
  return std::pow(nm / 560.0, -5.0) / std::expm1(1.4388e7 / (nm * kelvin));
}

using Weights = Eigen::Matrix<double, 3, kBands>;

// Rows: what each band adds to X/Xn, Y/Yn, Z/Zn.
const Weights& relative_xyz() {
  static const Weights weights = [] {
    Weights w;
    for (Eigen::Index band = 0; band < kBands; ++band) {
      const auto xyz = observer(nanometres(band));
      for (Eigen::Index i = 0; i < 3; ++i)
        w(i, band) = xyz[static_cast<std::size_t>(i)] * planck(nanometres(band), 5003.0);
    }
    for (Eigen::Index i = 0; i < 3; ++i) w.row(i) /= w.row(i).sum();
    return w;
  }();
  return weights;
}

double from_lab(double f) {
  constexpr double kStraight = 6.0 / 29.0;
  return f > kStraight ? f * f * f : 3.0 * kStraight * kStraight * (f - 4.0 / 29.0);
}

double to_lab(double t) {
  constexpr double kStraight = 6.0 / 29.0;
  return t > kStraight * kStraight * kStraight ? std::cbrt(t)
                                               : t / (3.0 * kStraight * kStraight) + 4.0 / 29.0;
}

// The smoothest spectrum of these XYZ, with some bands held at values.
Eigen::VectorXd smoothest(const Eigen::Vector3d& xyz,
                          const std::vector<std::pair<int, double>>& held) {
  Eigen::Matrix<double, kBands - 2, kBands> second;
  second.setZero();
  for (Eigen::Index i = 0; i < kBands - 2; ++i) second.block<1, 3>(i, i) << 1.0, -2.0, 1.0;
  const auto constraints = static_cast<Eigen::Index>(3 + held.size());
  Eigen::MatrixXd system = Eigen::MatrixXd::Zero(kBands + constraints, kBands + constraints);
  Eigen::VectorXd right = Eigen::VectorXd::Zero(kBands + constraints);
  system.topLeftCorner<kBands, kBands>() =
      second.transpose() * second + 1e-9 * Eigen::Matrix<double, kBands, kBands>::Identity();
  system.block(kBands, 0, 3, kBands) = relative_xyz();
  right.segment<3>(kBands) = xyz;
  for (std::size_t i = 0; i < held.size(); ++i) {
    const Eigen::Index row = kBands + 3 + static_cast<Eigen::Index>(i);
    system(row, held[i].first) = 1.0;
    right[row] = held[i].second;
  }
  system.topRightCorner(kBands, constraints) =
      system.bottomLeftCorner(constraints, kBands).transpose();
  return system.fullPivLu().solve(right).head<kBands>();
}

// What a camera channel makes of a spectrum lit through each of the projector's filters, of a perfect white's whole.
std::array<Rgb, 3> through_filters(const Spectrum& reflectance) {
  constexpr std::array<double, 3> kMiddles{600.0, 535.0, 455.0};
  constexpr std::array<double, 3> kWidths{38.0, 42.0, 30.0};
  std::array<Rgb, 3> seen{};
  for (std::size_t c = 0; c < 3; ++c) {
    double white = 0.0;
    for (Eigen::Index band = 0; band < kBands; ++band) {
      const double nm = nanometres(band);
      const double light = planck(nm, 6500.0) * lobe(nm, kMiddles[c], kWidths[c], kWidths[c]);
      const double red = 1.0 / (1.0 + std::exp((585.0 - nm) / 6.0));
      const double blue = 1.0 / (1.0 + std::exp((nm - 498.0) / 6.0));
      const std::array<double, 3> filters{red, std::max(0.0, 1.0 - red - blue), blue};
      for (std::size_t p = 0; p < 3; ++p)
        seen[c][p] += light * filters[p] * reflectance[static_cast<std::size_t>(band)];
      white += light * (filters[0] + filters[1] + filters[2]);
    }
    for (double& one : seen[c]) one /= white;
  }
  return seen;
}

Spectrum grey_spectrum(double reflectance) {
  Spectrum flat;
  flat.fill(reflectance);
  return flat;
}

// From picture to the chart's patches, (0, 0) to (6, 4): the inverse of the projective map of its corners.
Eigen::Matrix3d chart_from_picture(const std::array<std::array<double, 2>, 4>& corners) {
  const std::array<std::array<double, 2>, 4> chart{
      {{0, 0}, {kCheckerColumns, 0}, {kCheckerColumns, kCheckerRows}, {0, kCheckerRows}}};
  Eigen::Matrix<double, 8, 8> a;
  Eigen::Matrix<double, 8, 1> b;
  for (Eigen::Index i = 0; i < 4; ++i) {
    const auto [x, y] = corners[static_cast<std::size_t>(i)];
    const auto [u, v] = chart[static_cast<std::size_t>(i)];
    a.row(2 * i) << x, y, 1, 0, 0, 0, -u * x, -u * y;
    a.row(2 * i + 1) << 0, 0, 0, x, y, 1, -v * x, -v * y;
    b.segment<2>(2 * i) << u, v;
  }
  const Eigen::Matrix<double, 8, 1> h = a.fullPivLu().solve(b);
  Eigen::Matrix3d m;
  m << h[0], h[1], h[2], h[3], h[4], h[5], h[6], h[7], 1.0;
  return m;
}

std::size_t what_at(double u, double v, double patch_share) {
  if (u < -0.5 || v < -0.5 || u > kCheckerColumns + 0.5 || v > kCheckerRows + 0.5) return kWall;
  const double column = std::floor(u);
  const double row = std::floor(v);
  const bool inside = column >= 0 && row >= 0 && column < kCheckerColumns && row < kCheckerRows;
  const double edge = 0.5 * patch_share;
  if (!inside || std::abs(u - column - 0.5) > edge || std::abs(v - row - 0.5) > edge) return kFrame;
  return static_cast<std::size_t>(row * kCheckerColumns + column);
}

}  // namespace

std::array<double, 3> lab_of(const Spectrum& reflectance) {
  const Eigen::Map<const Eigen::Matrix<double, kBands, 1>> r(reflectance.data());
  const Eigen::Vector3d xyz = relative_xyz() * r;
  const double y = to_lab(xyz[1]);
  return {116.0 * y - 16.0, 500.0 * (to_lab(xyz[0]) - y), 200.0 * (y - to_lab(xyz[2]))};
}

Spectrum smooth_reflectance(const std::array<double, 3>& lab) {
  const double y = (lab[0] + 16.0) / 116.0;
  const Eigen::Vector3d xyz(
      from_lab(y + lab[1] / 500.0), from_lab(y), from_lab(y - lab[2] / 200.0));
  std::vector<std::pair<int, double>> held;
  Eigen::VectorXd r = smoothest(xyz, held);
  for (int tries = 0; tries < 12; ++tries) {
    bool good = true;
    for (int band = 0; band < kBands; ++band) {
      const bool is_held =
          std::ranges::any_of(held, [&](const auto& h) { return h.first == band; });
      if (is_held || (r[band] >= kLeast && r[band] <= kMost)) continue;
      held.emplace_back(band, r[band] < kLeast ? kLeast : kMost);
      good = false;
    }
    if (good || held.size() + 4 > kBands) break;
    r = smoothest(xyz, held);
  }
  Spectrum spectrum{};
  for (std::size_t band = 0; band < spectrum.size(); ++band)
    spectrum[band] = std::clamp(r[static_cast<Eigen::Index>(band)], 0.0, 1.0);
  return spectrum;
}

ChartOptions chart_before(const CameraOptics& camera) {
  constexpr std::array<std::array<double, 2>, 4> kPlaces{
      {{-0.33, -0.27},
       {0.34, -0.23},
       {0.32, 0.22},
       {-0.31, 0.18}}};  // of the width, from the middle
  ChartOptions chart;
  for (std::size_t i = 0; i < kPlaces.size(); ++i) {
    chart.corners[i] = {0.5 * camera.model.width + kPlaces[i][0] * camera.model.width,
                        0.5 * camera.model.height + kPlaces[i][1] * camera.model.width};
  }
  return chart;
}

ChartOptics::ChartOptics(const CameraOptics& camera,
                         const ProjectorOptics& projector,
                         const ChartOptions& options)
    : camera_(camera), projector_(projector), options_(options) {
  for (const ColorCheckerPatch& patch : kColorChecker)
    seen_.push_back(through_filters(smooth_reflectance(patch.lab)));
  seen_.push_back(through_filters(grey_spectrum(options.frame)));
  seen_.push_back(through_filters(grey_spectrum(options.wall)));
  look();
}

void ChartOptics::look() {
  const Eigen::Matrix3d to_chart = chart_from_picture(options_.corners);
  for (int y = 0; y < camera_.model.height; ++y) {
    for (int x = 0; x < camera_.model.width; ++x) {
      std::array<int, kWall + 1> counts{};
      for (int s = 0; s < kSamples * kSamples; ++s) {
        const int down = s / kSamples;
        const Eigen::Vector3d place =
            to_chart *
            Eigen::Vector3d(x + (s % kSamples + 0.5) / kSamples, y + (down + 0.5) / kSamples, 1.0);
        ++counts[what_at(place[0] / place[2], place[1] / place[2], options_.patch_share)];
      }
      for (std::size_t what = 0; what < counts.size(); ++what) {
        if (counts[what] == 0) continue;
        shares_.push_back({static_cast<std::uint32_t>(y) * camera_.model.width + x,
                           static_cast<std::uint8_t>(what),
                           static_cast<float>(counts[what]) / (kSamples * kSamples)});
      }
    }
  }
}

void ChartOptics::shine(Image<float>& picture, const Rgb& shown) const {
  if (options_.gloss_px <= 0.0) return;
  const Eigen::Matrix3d to_chart = chart_from_picture(options_.corners);
  const Eigen::Vector3d white = to_chart.inverse() * Eigen::Vector3d(0.5, 3.5, 1.0);
  for (int y = 0; y < picture.height(); ++y) {
    for (int x = 0; x < picture.width(); ++x) {
      if (std::hypot(x + 0.5 - white[0] / white[2], y + 0.5 - white[1] / white[2]) >
          options_.gloss_px)
        continue;
      for (int c = 0; c < 3; ++c) {
        const auto channel = static_cast<std::size_t>(c);
        picture.at(x, y, c) +=
            static_cast<float>(ChartOptions::kGloss * shown[channel] *
                               projector_.peak_irradiance[channel] / std::numbers::pi);
      }
    }
  }
}

StationLight ChartOptics::light(const Image<std::uint8_t>& codes) const {
  Rgb shown{};
  for (std::size_t i = 0; i < codes.samples().size(); ++i) {
    shown[i % 3] +=
        projector_.black_level +
        (1.0 - projector_.black_level) * std::pow(codes.samples()[i] / 255.0, projector_.gamma);
  }
  for (double& one : shown) one /= static_cast<double>(codes.pixel_count());
  StationLight light = dark();
  Image<float> picture(camera_.model.width, camera_.model.height, 3);
  for (const Share& share : shares_) {
    for (std::size_t c = 0; c < 3; ++c) {
      double radiance = 0.0;
      for (std::size_t p = 0; p < 3; ++p)
        radiance += seen_[share.what][c][p] * shown[p] * projector_.peak_irradiance[p];
      picture.samples()[3 * std::size_t{share.pixel} + c] +=
          static_cast<float>(share.share * radiance / std::numbers::pi);
    }
  }
  shine(picture, shown);
  light.sensor_radiance = blurred(picture, camera_.psf_sigma_px);
  return light;
}

std::string ChartOptics::scene() const {
  return nlohmann::json{{"kind", "color_chart"}, {"corners_px", options_.corners}}.dump();
}

}  // namespace opaline::sim
