#pragma once

#include <string>
#include <vector>

#include "base/block.h"
#include "base/result.h"

namespace opaline::bench {

/// How long a minimisation takes, all three channels.
struct Timing {
  double seconds_per_iteration = 0.0;  ///< of one channel, the median, on whichever grid
  int iterations = 0;                  ///< of one channel, coarser grids' too
  double channel_seconds = 0.0;  ///< one channel from its beginning to its end; 0: not run to it
  double seconds() const {
    return 3.0 * (channel_seconds > 0.0 ? channel_seconds : seconds_per_iteration * iterations);
  }
};

/// One row of Wang 2008, Table II, beside ours.
struct TimedSample {
  std::string name;
  Block block;
  double paper_hours = 0.0;  ///< on its hardware of 2008; 0: not in the table
  Timing ours;
  Timing published;
  bool published_converged = false;  ///< else its iterations are those of the sample that did
};

/// Times a sample of each of the table's four grids, and one of 48 x 48 x 12 on which the published minimisation runs until
/// our stopping rule holds. On the others its time an iteration is measured and its iterations are taken from that one;
/// both minimisations use our solver, so the paper's relaxation is not in it. 16 pictures, 1 % noise; the data come from the
/// reconstruction's own grid, which serves a clock. `quick`: only 24 x 24 x 6 and 48 x 48 x 12.
Result<std::vector<TimedSample>> time_table(bool quick);

}  // namespace opaline::bench
