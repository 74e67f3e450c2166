#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "base/thread_team.h"
#include "reconstruct/spherical_gradient/scattering_maps.h"

namespace opaline::reconstruct {

/// The curvature of a picture's pixels summed over blocks of side x side of them, so that what is known of it around any pixel costs the same however many pixels
/// there are: sums over rectangles by summed areas (Crow 1984). A pixel whose curvature is known to sigma weighs 1 / (1 + sigma^2 / f^2), f a tenth of what the
/// answers' curvatures commonly are: few that kept a small window would else outweigh all others. Pixels of curvature 0 have none.
/// Threads: const, any number.
class CurvatureBlocks {
 public:
  struct Around {
    double count = 0.0;     ///< of pixels, by weight; nothing but `concave` is set where it is 0
    double mean = 0.0;      ///< 1/mm
    double variance = 0.0;  ///< of the pixels' curvatures, 1/mm^2
    double by_x = 0.0;      ///< slope of a plane fitted to them, 1/mm a pixel
    double by_y = 0.0;
    double concave = 0.0;  ///< pixels that are LeftOut::kConcave
  };
  CurvatureBlocks(const ScatteringMaps& maps, int side, ThreadTeam& team);
  /// Over the blocks within `half` pixels of a pixel's own, at least one on either side.
  Around around(int x, int y, double half) const;
  /// The same, remembering the last answer for the next pixel.
  class Walker {
   public:
    explicit Walker(const CurvatureBlocks& blocks) : blocks_(blocks) {}
    const Around& around(int x, int y, double half);

   private:
    const CurvatureBlocks& blocks_;
    std::array<int, 3> at_{-1, -1, -1};
    Around last_;
  };
  int side() const { return side_; }

  /// So many pixels that light within `reach` of them meets eight blocks.
  static int side_for(double reach);

 private:
  enum Term : std::size_t { kCount, kX, kY, kXX, kXY, kYY, kH, kHX, kHY, kHH, kConcaves, kTerms };
  using Sum = std::array<double, kTerms>;
  const Sum& corner(int x, int y) const {
    return sums_[static_cast<std::size_t>(y) * static_cast<std::size_t>(width_ + 1) +
                 static_cast<std::size_t>(x)];
  }
  Sum block(const ScatteringMaps& maps, int bx, int by) const;

  int side_;
  double floor_;  // f^2
  int width_;     // blocks
  int height_;    // blocks
  std::vector<Sum> sums_;
};

/// Of a map's values where there is an answer, by a sample of some ten thousand of them; 0 where there is none.
double quantile_of_answers(const ScatteringMaps& maps,
                           const std::vector<float>& values,
                           double share);

}  // namespace opaline::reconstruct
