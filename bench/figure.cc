#include "bench/figure.h"

#include <fmt/format.h>
#include <malloc.h>

#include <algorithm>
#include <cstdio>
#include <fstream>
#include <limits>
#include <string>

namespace opaline::bench {

void print_figure(std::string_view figure,
                  std::string_view which,
                  double value,
                  std::string_view unit) {
  fmt::print(R"({{"figure": "{}", "case": "{}", "value": {:.6g}, "unit": "{}"}})"
             "\n",
             figure,
             which,
             value,
             unit);
  std::fflush(stdout);
}

double median(std::vector<double> values) {
  if (values.empty()) return std::numeric_limits<double>::quiet_NaN();
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

double peak_megabytes() {
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);)
    if (line.starts_with("VmHWM:")) return std::stod(line.substr(6)) / 1024.0;
  return 0.0;
}

void reset_peak_megabytes() {
  ::malloc_trim(0);
  std::ofstream("/proc/self/clear_refs") << "5";  // VmHWM, proc(5)
}

}  // namespace opaline::bench
