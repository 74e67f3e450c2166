#pragma once

#include <chrono>
#include <cstdint>
#include <limits>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <utility>

#include "base/result.h"

namespace opaline::sim {

/// Reads the fields of a message's header, which may say anything, and keeps the first thing that is wrong. What is
/// missing or wrong reads as the lowest value, or empty: result() tells before it is used.
class RigHeader {
 public:
  explicit RigHeader(const nlohmann::json& header) : header_(header) {}

  template <class T>
  T whole(std::string_view name,
          T low = std::numeric_limits<T>::min(),
          T high = std::numeric_limits<T>::max()) {
    const auto fits = [&](auto value) {
      return std::cmp_greater_equal(value, low) && std::cmp_less_equal(value, high);
    };
    const nlohmann::json& field = find(name);
    if (field.is_number_unsigned()) {
      if (const auto value = field.get<std::uint64_t>(); fits(value)) return static_cast<T>(value);
    } else if (field.is_number_integer()) {
      if (const auto value = field.get<std::int64_t>(); fits(value)) return static_cast<T>(value);
    }
    fail(name, "a whole number in its range");
    return low;
  }
  std::chrono::nanoseconds time(std::string_view name) {
    return std::chrono::nanoseconds(whole<std::chrono::nanoseconds::rep>(name));
  }
  double number(std::string_view name);
  bool flag(std::string_view name);
  std::string text(std::string_view name);
  /// The field itself; null when there is none.
  const nlohmann::json& find(std::string_view name) const;

  Result<void> result() const { return result_; }

 private:
  void fail(std::string_view name, std::string_view expected);

  const nlohmann::json& header_;
  Result<void> result_ = ok();
};

}  // namespace opaline::sim
