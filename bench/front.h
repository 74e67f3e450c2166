#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"

namespace opaline::bench {

/// A setting of a program's dials: what it takes and how far off it is.
struct FrontPoint {
  std::string name;
  std::string group;  ///< drawn in a colour of its own
  double seconds = 0.0;
  double error = 0.0;  ///< relative
};

/// Those that no other beats in both, the quickest first.
std::vector<FrontPoint> front_of(std::vector<FrontPoint> points);

/// Writes `file`, an SVG of error (in per cent) against seconds on logarithmic axes with the front as a line, and beside it, as .csv,
/// what it shows. Errors: those of daemon::draw() and write_whole().
Result<void> draw_front(const std::vector<FrontPoint>& points,
                        std::string_view seconds_label,
                        std::string_view error_label,
                        const std::string& file);

}  // namespace opaline::bench
