#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "base/image.h"
#include "capture/calibration.h"
#include "capture/hdr_merge.h"

namespace opaline::capture {

/// What two exposures of one light say of the same pixels.
struct ExposureComparison {
  /// A figure with its standard deviation from the frames' noise.
  struct Figure {
    double value = 0.0;
    double deviation = 0.0;
    /// Whether it is above a limit, and not by noise.
    bool exceeds(double limit, double deviations) const;
  };
  /// Where the two differ in part, after what all of it has in common is taken away: light of 16 x 16 pixels.
  struct Part {
    Figure light;  ///< relative
    int x = 0;     ///< its middle, px
    int y = 0;
    double inverse_signal = 0.0;  ///< as below, of this part
  };
  /// Of the shorter exposure over the longer one, less 1; by channel, none of a channel without enough usable pixels.
  std::array<std::optional<Figure>, 3> light;
  Figure levels;        ///< by how much, relative, bright and dark parts disagree (RMS)
  Figure shift;         ///< by how much, relative, light is changed by the picture's shift (RMS)
  double shift_px = 0;  ///< how far that is
  std::vector<Part> parts;  ///< six deviations off, or more
  /// Of the shorter exposure's signal over full scale, mean of its inverse: what an error of black or response, in parts of full scale, does there.
  double inverse_signal = 0.0;
};

/// Compares rates (code less black, by the response, over the time) of a shorter exposure, a, and a longer one, b, of the same light. Where
/// both are above their noise and neither clips,
///
///   a - b = g b + h b ln(b / full scale) + dx db/dx + dy db/dy + noise
///
/// by least squares weighted with the camera's noise model: g, h by channel (light, and an error of the response's exponent), one shift
/// (dx, dy) of the picture. On the right b and its slopes come from the eight pixels around, so that no noise stands on both sides. Which
/// pixels are bright enough is told by tiles of 16 x 16, so that it does not follow noise either. What g and h leave is averaged over tiles of 16 x 16 pixels: light that has
/// changed in one place. Single wild samples count as at most their own light.
///
/// `footprint` marks the pixels (1) to look at. None where fewer than 200 samples can be compared.
class ExposureComparer {
 public:
  explicit ExposureComparer(const CameraCalibration& camera);
  std::optional<ExposureComparison> compare(const ExposurePair& shorter,
                                            const ExposurePair& longer,
                                            const Image<std::uint8_t>& footprint) const;

 private:
  struct Sample {
    double difference = 0.0;
    double around = 0.0;  ///< b
    double slope_x = 0.0;
    double slope_y = 0.0;
    double weight = 0.0;
    double level = 0.0;   ///< b over full scale, > 0
    double signal = 0.0;  ///< of the shorter exposure around, over full scale
  };
  struct Rates {  ///< mean of a tile, electrons a second
    double light = 0.0;
    double leak = 0.0;
  };
  struct Sums;
  struct Fit;
  std::optional<Sample> sample_at(const ExposurePair& shorter,
                                  const ExposurePair& longer,
                                  const Image<std::uint8_t>& footprint,
                                  int x,
                                  int y,
                                  int channel,
                                  const Rates& tile) const;
  std::vector<std::array<Rates, 3>> tile_rates(const ExposurePair& longer,
                                               const Image<std::uint8_t>& footprint) const;
  Sums sums_of(const ExposurePair& shorter,
               const ExposurePair& longer,
               const Image<std::uint8_t>& footprint) const;

  CameraCalibration camera_;
  std::vector<Electrons> electrons_;  // by code
  double clipping_electrons_;
};

}  // namespace opaline::capture
