#pragma once

#include <fmt/format.h>

#include <cmath>
#include <string_view>

#include "base/result.h"

namespace opaline::sim {

/// Collects the first thing wrong with some options: `OptionsCheck().above("gamma", gamma,
/// 0.0)...result()`.
class OptionsCheck {
 public:
  OptionsCheck& within(std::string_view name, double value, double low, double high) {
    return expect(value >= low && value <= high, name, value, fmt::format("{} to {}", low, high));
  }
  OptionsCheck& above(std::string_view name, double value, double low) {
    return expect(value > low && std::isfinite(value), name, value, fmt::format("> {}", low));
  }
  OptionsCheck& at_least(std::string_view name, double value, double low) {
    return expect(value >= low && std::isfinite(value), name, value, fmt::format(">= {}", low));
  }
  Result<void> result() const { return result_; }

 private:
  OptionsCheck& expect(bool good, std::string_view name, double value, std::string_view expected) {
    if (!good && result_) {
      result_ = invalid_argument(fmt::format("{} = {}; expected {}", name, value, expected));
    }
    return *this;
  }
  Result<void> result_ = ok();
};

}  // namespace opaline::sim
