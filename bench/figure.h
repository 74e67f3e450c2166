#pragma once

#include <string_view>
#include <vector>

namespace opaline::bench {

/// Prints one figure as a line of its own on standard output, at once:
/// {"figure": "forward.seconds", "case": "wax1", "value": 0.04, "unit": "s"}.
void print_figure(std::string_view figure,
                  std::string_view which,
                  double value,
                  std::string_view unit);

/// The middle of the values; of an even number the upper of the two; of none, not a number.
double median(std::vector<double> values);

/// What this program has held at most since it began, or since the last reset, MB.
double peak_megabytes();
/// Gives free memory back and counts from here.
void reset_peak_megabytes();

}  // namespace opaline::bench
