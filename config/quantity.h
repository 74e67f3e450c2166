#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "config/fields.h"

namespace opaline::config {

/// Reads "33 ms", "1/30 s", "24 mm", "0.5 um", "10 deg" in the unit's base: s, mm, degrees.
/// Nothing when the number or the unit cannot be understood.
std::optional<double> parse_quantity(std::string_view text, Unit unit);

/// The shortest text that reads back as the same quantity; times to the nanosecond.
std::string format_quantity(double value, Unit unit);

/// What a quantity looks like, for messages: `a length with a unit, such as "24 mm"`.
std::string_view describe(Unit unit);

/// "more than 0", "at least 1", "0 to 1", "at least 0, less than 1"; empty when everything is allowed.
std::string describe(const Range& range, Unit unit);
bool contains(const Range& range, double value);

/// The name with the fewest edits from `word`, when it is near enough to be meant.
std::optional<std::string_view> nearest(std::string_view word,
                                        std::span<const std::string_view> names);

}  // namespace opaline::config
