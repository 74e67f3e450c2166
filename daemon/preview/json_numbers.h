#pragma once

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

namespace opaline::daemon {

inline bool is_finite_number(const nlohmann::json& value) {
  return value.is_number() && std::isfinite(value.get<double>());
}

inline bool is_three_numbers(const nlohmann::json& value) {
  return value.is_array() && value.size() == 3 && std::ranges::all_of(value, is_finite_number);
}

}  // namespace opaline::daemon
