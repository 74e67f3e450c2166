#include "bench/figure.h"

#include <fmt/format.h>
#include <sys/resource.h>

#include <algorithm>
#include <cstdio>

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
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

double peak_megabytes() {
  rusage usage{};
  ::getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_maxrss) / 1024.0;
}

}  // namespace opaline::bench
