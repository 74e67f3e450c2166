#pragma once

#include <cstdint>
#include <vector>

#include "base/block.h"
#include "base/image.h"
#include "sim/optics.h"

namespace opaline::sim {

/// A place of a face, mm from the corner where its raster begins.
struct FacePlace {
  double column = 0.0;
  double row = 0.0;
};
/// Where the light through a place of the projector's picture meets the plane of the lit face.
FacePlace lit_by(
    const ProjectorOptics& projector, const Block& block, Face lit_face, double x, double y);

/// The lit face, divided into across x down equal rectangles (column fastest), and the pixels that light each. Of a perpendicular projector
/// pixels count by the area they share with a rectangle; of one in perspective the pixels that a raster of points, half a pixel
/// apart, is lit by. Beside the picture it is dark, and so is a face that the projector is behind.
///
/// Threads: const, so any number at a time.
class LitFace {
 public:
  LitFace(
      const ProjectorOptics& projector, const Block& block, Face lit_face, int across, int down);

  /// Mean irradiance of each rectangle under a picture, W/mm^2.
  std::vector<Rgb> irradiance(const Image<std::uint8_t>& codes) const;

 private:
  void cover(const Block& block, Face lit_face, int across, int down);
  void sample(const Block& block, Face lit_face, int across, int down);

  struct Share {
    std::uint32_t pixel;
    float weight;  ///< of the rectangle's irradiance over the pixel's
  };
  ProjectorOptics projector_;
  Image<float> vignetting_;
  std::vector<std::size_t> first_share_;  ///< per rectangle, and one behind the last
  std::vector<Share> shares_;
};

}  // namespace opaline::sim
