#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "base/image.h"
#include "base/material.h"
#include "reconstruct/homogeneous_fit.h"

namespace opaline::reconstruct {

/// Why the minimisation of a channel ended.
enum class StopReason : std::uint8_t {
  kDiscrepancy,  ///< the pictures are explained to within their variance: going on would fit the
                 ///< noise
  kStalled,      ///< the objective hardly falls any more
  kNoDescent,    ///< a minimum, to the accuracy of the solves
  kIterationLimit,
};
std::string_view to_string(
    StopReason reason);  ///< "discrepancy" | "stalled" | "no_descent" | "iteration_limit"
std::string_view explain(StopReason reason);  ///< one sentence for people

/// One iteration; the first of a history, 0, is the homogeneous fit; those of the models taken follow on each other.
struct IterationRecord {
  int iteration = 0;
  double objective = 0.0;
  double chi_squared_per_datum = 0.0;
  double regularization = 0.0;
  /// For one right-hand side, of the channel so far; one on a coarser grid counts as its share of the cells.
  long solves = 0;
  bool operator==(const IterationRecord&) const = default;
};

/// What became of one model of the ladder (reconstruct/model_ladder.h). Errors are chi^2 per datum, with weights that count
/// the measured variance and the model's error: 1 is what those two make.
struct ModelReport {
  std::string name;             ///< "layered"
  std::size_t parameters = 0;   ///< of the channel
  double fitted = 0.0;          ///< over the illuminations of the fit
  double held_out = 0.0;        ///< over those kept from it; 0 where there are none
  double standard_error = 0.0;  ///< of held_out
  double gain = 0.0;        ///< fall of held_out against the rung taken before; the first has none
  double gain_error = 0.0;  ///< standard error of that, pairwise
  long solves = 0;          ///< for one right-hand side, of this rung
  double seconds = 0.0;
  bool taken = false;
  std::string why;  ///< one sentence
};

/// How the reconstruction of one channel went.
struct ChannelReport {
  HomogeneousFit homogeneous;
  std::vector<IterationRecord> history;
  StopReason stop_reason = StopReason::kIterationLimit;
  std::size_t data_count = 0;
  double noise_per_datum = 0.0;   ///< chi^2 per datum that measured noise alone makes
  double target_per_datum = 0.0;  ///< at which the pictures count as explained
  long solves = 0;                ///< for one right-hand side
  double seconds = 0.0;
  std::vector<ModelReport> ladder;  ///< in the order they were tried
  double held_out_noise = 0.0;      ///< chi^2 per held-out datum that measured noise alone makes
  bool cross_validated =
      false;  ///< held out of the fit's own illuminations, the dataset having none
  double grid_correction = 0.0;  ///< ||delta|| / ||L|| (reconstruct/grid_correction.h); 0: none
  std::string model;             ///< the rung that the channel stands on: "layered"
  std::string model_reason;      ///< why no finer one, one sentence
};

/// ||L - L*|| / ||L*|| over the usable cells of some illuminations, and what their noise alone
/// would give.
struct RelightingError {
  double error = 0.0;
  double noise_floor = 0.0;
};

/// A reconstruction: the material, how it came about, and what it predicts.
struct InverseResult {
  Material material;
  std::array<ChannelReport, kColorChannels> channels;
  std::vector<Image<float>>
      predicted;  ///< radiance per illumination of the dataset, held-out ones too; as measured ones
  RelightingError fitted;               ///< over the illuminations of the fit
  RelightingError held_out;             ///< over those kept from it; 0 when there is none
  double direct_light_margin_mm = 0.0;  ///< around lit cells on the seen face, left out
  std::string solver;                   ///< "host, 2 threads, AVX2"
  double seconds = 0.0;
};

}  // namespace opaline::reconstruct
