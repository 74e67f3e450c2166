#include "capture/capture_options.h"

#include <fmt/format.h>

#include <initializer_list>
#include <string_view>

#include "base/seconds.h"

namespace opaline::capture {
namespace {

struct Check {
  bool good;
  std::string_view name;
  double value;
  std::string_view expected;
};

}  // namespace

Result<void> validate(const CaptureOptions& options) {
  const PatternOptions& p = options.patterns;
  const ExposureOptions& e = options.exposures;
  for (const Check& check : std::initializer_list<Check>{
           {p.regions >= 1 && p.regions <= 32, "regions", 1.0 * p.regions, "1 to 32"},
           {p.held_out_lights >= 0 && p.held_out_lights <= 8,
            "held_out_lights",
            1.0 * p.held_out_lights,
            "0 to 8"},
           {p.uniform_light_code >= 1 && p.uniform_light_code <= 255,
            "uniform_light_code",
            1.0 * p.uniform_light_code,
            "1 to 255"},
           {e.shortest.count() > 0, "exposures.shortest", seconds(e.shortest), "> 0 s"},
           {e.longest >= e.shortest, "exposures.longest", seconds(e.longest), ">= shortest"},
           {e.ratio > 1.0 && e.ratio <= 16.0, "exposures.ratio", e.ratio, "> 1 and at most 16"},
           {e.wanted_snr > 0.0, "exposures.wanted_snr", e.wanted_snr, "> 0"},
           {e.dark_quantile >= 0.0 && e.dark_quantile <= 0.5,
            "exposures.dark_quantile",
            e.dark_quantile,
            "0 to 0.5"},
           {e.planned_snr > 0.0, "exposures.planned_snr", e.planned_snr, "> 0"},
           {e.planned_share > 0.0 && e.planned_share <= 1.0,
            "exposures.planned_share",
            e.planned_share,
            "> 0 and at most 1"},
           {e.dim_share >= 0.0 && e.dim_share <= 1.0, "exposures.dim_share", e.dim_share, "0 to 1"},
           {options.retries >= 0 && options.retries <= 100,
            "retries",
            1.0 * options.retries,
            "0 to 100"},
           {options.settle_periods >= 0 && options.settle_periods <= 1000,
            "settle_periods",
            1.0 * options.settle_periods,
            "0 to 1000"},
           {options.min_coverage > 0.0 && options.min_coverage <= 1.0,
            "min_coverage",
            options.min_coverage,
            "> 0 and at most 1"},
           {options.direct_light_margin_mm >= 0.0 && options.direct_light_margin_mm <= 1000.0,
            "direct_light_margin_mm",
            options.direct_light_margin_mm,
            "0 to 1000"},
           {options.usable_share >= 0.0 && options.usable_share <= 1.0,
            "usable_share",
            options.usable_share,
            "0 to 1"}}) {
    if (check.good) continue;
    return invalid_argument(
        fmt::format("capture.{} = {}; expected {}", check.name, check.value, check.expected));
  }
  return ok();
}

}  // namespace opaline::capture
