#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "base/color_checker.h"
#include "base/image.h"
#include "sim/station_light.h"

namespace opaline::sim {

/// 400 to 700 nm, every 10 nm.
using Spectrum = std::array<double, 31>;

/// The reflectance that is smoothest among those of a CIELAB colour under D50 (the least sum of squared second differences,
/// Burns 2015), kept within 0.5 and 98 %. With the CIE 1931 observer by Wyman, Sloan and Shirley 2013 and Planck's 5003 K for D50; Lab is relative
/// to that white.
Spectrum smooth_reflectance(const std::array<double, 3>& lab);
/// CIELAB of a reflectance under that light.
std::array<double, 3> lab_of(const Spectrum& reflectance);

/// A colour chart before the camera.
struct ChartOptions {
  /// Of its 6 x 4 patches' outline in the camera's picture, px: upper left, upper right, lower right, lower left of the chart
  /// itself, wherever these are in the picture.
  std::array<std::array<double, 2>, 4> corners{{{60, 80}, {200, 80}, {200, 176}, {60, 176}}};
  double patch_share = 0.82;  ///< of the distance between patches
  double frame = 0.03;        ///< reflectance of what is between them and half a patch around
  double wall = 0.2;          ///< of what is behind
  /// Radius of the lamp's mirror image in the middle of the white patch, px, on which it is kGloss times as bright as a perfect
  /// white; 0: the chart is matt.
  double gloss_px = 0.0;
  static constexpr double kGloss = 40.0;
};

/// A chart that lies a little askew in the middle of the picture, over half of its width.
ChartOptions chart_before(const CameraOptics& camera);

/// What a camera sees of a chart that a projector lights evenly: its spectra through the projector's red, green and blue filters
/// before a lamp of 6500 K, and through the camera's filters, which are none of the eye's (Gaussians about 600, 535 and 455 nm). A perfect
/// white under the projector's white has the radiance peak / pi in each channel. Codes are taken as their mean over the picture.
class ChartOptics : public LightPath {
 public:
  ChartOptics(const CameraOptics& camera,
              const ProjectorOptics& projector,
              const ChartOptions& options);
  StationLight light(const Image<std::uint8_t>& codes) const override;
  StationLight dark() const override { return {{Rgb{}}, Image<float>(1, 1, 3), {}}; }
  int patches_x() const override { return 1; }
  int patches_y() const override { return 1; }
  std::string scene() const override;

 private:
  void look();
  void shine(Image<float>& picture, const Rgb& shown) const;
  CameraOptics camera_;
  ProjectorOptics projector_;
  ChartOptions options_;
  /// Of 24 patches, frame and wall: camera channel by projector channel, so that a perfect white has sums of 1.
  std::vector<std::array<Rgb, 3>> seen_;
  /// Of each pixel: what it sees of each of these, by area.
  struct Share {
    std::uint32_t pixel;
    std::uint8_t what;
    float share;
  };
  std::vector<Share> shares_;
};

}  // namespace opaline::sim
