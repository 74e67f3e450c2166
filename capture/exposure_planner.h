#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "base/image.h"
#include "capture/calibration.h"
#include "capture/capture_options.h"
#include "capture/exposure_chooser.h"
#include "capture/exposure_planning.h"
#include "capture/surface_map.h"

namespace opaline::capture {

/// The surface cells that exposures are planned for, and the camera pixels that each is seen by.
class PlannedCells {
 public:
  /// `usable`: 1 for pixels that see the sample and are not hot. Cells without `min_coverage` of their area on such are left
  /// out; of more than 1024 an even choice stands for all.
  PlannedCells(const SurfaceMap& map, const Image<std::uint8_t>& usable, double min_coverage);

  struct Pixel {
    std::size_t place = 0;  ///< among the picture's pixels, row by row
    double weight = 0.0;    ///< in the cell's mean; they add up to 1
  };
  struct Cell {
    std::vector<Pixel> pixels;
    double count = 1.0;     ///< 1 / sum of weights squared
    std::size_t place = 0;  ///< among the face's cells, row by row
  };
  const std::vector<Cell>& cells() const { return cells_; }

 private:
  std::vector<Cell> cells_;
};

/// Plans the exposures of one light from the frames of it taken so far: the shortest first, for a first look that no cell
/// clips in if any exposure spares it; then, after each frame anew, what plan_exposures() says from the light seen by then, the
/// longest first but none more than four times all before it together, for dim cells are known badly at first. A cell that
/// is darker than ExposureOptions::dim_share of the light's brightest needs only the noise of one so bright. It ends when
/// the goal is reached by the noise model, or when the time is up.
/// The same frames give the same choice.
class ExposurePlanner : public ExposureChooser {
 public:
  /// `cells` outlives us; those where `ignored` is not 0 do not count (empty: all do). At most `most_seconds` are taken. `blacks` of each
  /// exposure are as good as what will be subtracted (BlackFrames::worth(); empty: one each, until a frame of it is added).
  ExposurePlanner(const ExposureOptions& options,
                  const CameraCalibration& camera,
                  std::span<const std::chrono::nanoseconds> ladder,
                  double most_seconds,
                  const PlannedCells& cells,
                  const Image<std::uint8_t>& ignored = {},
                  std::span<const int> blacks = {});
  std::optional<std::size_t> next() override;
  void add(std::size_t index, const ExposurePair& pair, const FrameLight& light) override;

  /// What is known: `taken` frames of each exposure, and the light of the cells.
  const ExposureProblem& problem() const { return problem_; }

 private:
  struct Seen {  // of one pixel in one channel
    double electrons = 0.0;
    double leak = 0.0;
    double seconds = 0.0;
    double black_seconds = 0.0;
  };
  void collect(const ExposurePair& pair, bool shortest);
  void estimate();

  void want();

  CameraCalibration camera_;
  double wanted_snr_;
  double dim_share_;
  std::vector<const PlannedCells::Cell*> cells_;
  std::vector<Seen> seen_;            // 3 samples for each pixel of each cell
  std::vector<Electrons> electrons_;  // by code
  double clipping_code_;
  ExposureProblem problem_;
  double most_seconds_;
};

}  // namespace opaline::capture
