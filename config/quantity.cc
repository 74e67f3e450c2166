#include "config/quantity.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <numeric>
#include <vector>

namespace opaline::config {
namespace {

struct NamedUnit {
  std::string_view name;
  Unit unit;
  double times;  ///< and divided by, to be in the base unit: both exact, so that the result is
  double over;   ///< the double nearest to what was written
};

constexpr std::array kUnits{NamedUnit{"s", Unit::kTime, 1, 1},
                            NamedUnit{"ms", Unit::kTime, 1, 1e3},
                            NamedUnit{"us", Unit::kTime, 1, 1e6},
                            NamedUnit{"µs", Unit::kTime, 1, 1e6},
                            NamedUnit{"ns", Unit::kTime, 1, 1e9},
                            NamedUnit{"min", Unit::kTime, 60, 1},
                            NamedUnit{"h", Unit::kTime, 3600, 1},
                            NamedUnit{"mm", Unit::kLength, 1, 1},
                            NamedUnit{"cm", Unit::kLength, 10, 1},
                            NamedUnit{"m", Unit::kLength, 1e3, 1},
                            NamedUnit{"um", Unit::kLength, 1, 1e3},
                            NamedUnit{"µm", Unit::kLength, 1, 1e3},
                            NamedUnit{"deg", Unit::kAngle, 1, 1},
                            NamedUnit{"rad", Unit::kAngle, 180, 3.14159265358979323846},
                            NamedUnit{"%", Unit::kShare, 1, 100}};

std::string_view trim(std::string_view text) {
  const std::size_t first = text.find_first_not_of(' ');
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(' ') - first + 1);
}

/// Reads a number off the front of `text`.
std::optional<double> take_number(std::string_view& text) {
  double value = 0.0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || !std::isfinite(value)) return std::nullopt;
  text.remove_prefix(static_cast<std::size_t>(end - text.data()));
  return value;
}

std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t replaced = diagonal + (a[i - 1] == b[j - 1] ? 0 : 1);
      diagonal = row[j];
      row[j] = std::min({replaced, row[j] + 1, row[j - 1] + 1});
    }
  }
  return row[b.size()];
}

/// In per cent, with as few digits as read back to the same share.
std::string format_share(double value) {
  for (int digits = 1; digits < 17; ++digits) {
    std::string text = fmt::format("{:.{}g}", 100.0 * value, digits);
    const bool plain = value < 0.01 || text.find('e') == std::string::npos;  // "50", not "5e+01"
    if (plain && std::strtod(text.c_str(), nullptr) / 100.0 == value) return text + " %";
  }
  return fmt::format("{} %", 100.0 * value);
}

std::string_view suffix(Unit unit) {
  switch (unit) {
    case Unit::kLength:
      return " mm";
    case Unit::kTime:
      return " s";
    case Unit::kAngle:
      return " deg";
    case Unit::kShare:
    case Unit::kPlain:
      break;
  }
  return "";
}

/// Times are kept in whole nanoseconds; what rounds to the same number of them is the same time.
std::string format_short_time(double nanoseconds) {
  for (const auto& [name, factor] : {std::pair{"ms", 1e6}, {"us", 1e3}}) {
    if (std::fmod(nanoseconds, factor) == 0.0) {
      return fmt::format("{:.0f} {}", nanoseconds / factor, name);
    }
  }
  const double divisor = std::round(1e9 / nanoseconds);
  if (divisor <= 1000.0 && std::round(1e9 / divisor) == nanoseconds) {
    return fmt::format("1/{:.0f} s", divisor);
  }
  return fmt::format("{:.0f} ns", nanoseconds);
}

}  // namespace

std::optional<double> parse_quantity(std::string_view text, Unit unit) {
  text = trim(text);
  auto value = take_number(text);
  if (!value) return std::nullopt;
  if (!text.empty() && text.front() == '/') {
    text.remove_prefix(1);
    const auto divisor = take_number(text);
    if (!divisor || *divisor == 0.0) return std::nullopt;
    value = *value / *divisor;
  }
  const std::string_view name = trim(text);
  const auto* const found = std::find_if(kUnits.begin(), kUnits.end(), [&](const NamedUnit& known) {
    return known.unit == unit && known.name == name;
  });
  if (found == kUnits.end()) return std::nullopt;
  return *value * found->times / found->over;
}

std::string format_quantity(double value, Unit unit) {
  if (unit == Unit::kTime && value > 0.0 && value < 1.0) {
    if (std::string text = format_short_time(std::round(value * 1e9)); !text.empty()) {
      return text;
    }
  }
  if (unit == Unit::kShare) return format_share(value);
  return fmt::format("{}{}", value, suffix(unit));
}

std::string_view describe(Unit unit) {
  switch (unit) {
    case Unit::kLength:
      return "a length with its unit, such as \"24 mm\"";
    case Unit::kTime:
      return "a time with its unit, such as \"33 ms\" or \"1/30 s\"";
    case Unit::kAngle:
      return "an angle with its unit, such as \"10 deg\"";
    case Unit::kShare:
      return "a share in per cent, such as \"2 %\"";
    case Unit::kPlain:
      break;
  }
  return "a number";
}

std::string describe(const Range& range, Unit unit) {
  const Range all;
  const std::string min = format_quantity(range.min, unit);
  const std::string max = format_quantity(range.max, unit);
  const bool is_limited = range.max != all.max;
  const std::string below = (range.max_excluded ? "less than " : "at most ") + max;
  if (range.min == all.min) return is_limited ? below : "";
  if (is_limited && !range.min_excluded && !range.max_excluded) {
    return fmt::format("{} to {}", min, max);
  }
  return fmt::format("{} {}{}",
                     range.min_excluded ? "more than" : "at least",
                     min,
                     is_limited ? ", " + below : "");
}

bool contains(const Range& range, double value) {
  return (range.min_excluded ? value > range.min : value >= range.min) &&
         (range.max_excluded ? value < range.max : value <= range.max);
}

std::optional<std::string_view> nearest(std::string_view word,
                                        std::span<const std::string_view> names) {
  std::optional<std::string_view> best;
  std::size_t fewest = std::max<std::size_t>(2, word.size() / 3) + 1;
  for (const std::string_view name : names) {
    const std::size_t edits = edit_distance(word, name);
    if (edits < fewest) {
      fewest = edits;
      best = name;
    }
  }
  return best;
}

}  // namespace opaline::config
