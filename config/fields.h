#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <limits>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace opaline::config {

/// A key of a TOML table and what it means, in one line for people.
struct Key {
  std::string_view name;
  std::string_view help;
  bool required = false;  ///< missing is a problem; otherwise the value stays as it is
};

/// What a number is: a quantity is written with its unit ("33 ms", "24 mm", "10 deg", "1/30 s",
/// "2 %"), a plain number without, and then the key's name carries the unit where there is one.
enum class Unit : std::uint8_t { kPlain, kLength, kTime, kAngle, kShare };

/// Allowed values.
struct Range {
  double min = std::numeric_limits<double>::lowest();
  double max = std::numeric_limits<double>::max();
  bool min_excluded = false;
  bool max_excluded = false;

  static Range at_least(double value) { return {.min = value}; }
  static Range above(double value) { return {.min = value, .min_excluded = true}; }
  static Range between(double low, double high) { return {.min = low, .max = high}; }
};

/// What a duration may be, in seconds, unless a key says otherwise: nanoseconds hold it.
inline constexpr Range kDurations{.min = 1e-9, .max = 1e5};

/// Visits the keys of one TOML table in order. Reading fills the values in and writing prints them
/// by the same visit, so that what is read, written and explained cannot differ.
///
/// Reading goes on after a problem: the value stays as it was, and the visit finds the next one.
class Fields {
 public:
  using Visit = std::function<void(Fields&)>;

  virtual ~Fields() = default;
  Fields() = default;
  Fields(const Fields&) = delete;
  Fields& operator=(const Fields&) = delete;

  virtual void table(const Key& key, const Visit& visit) = 0;
  /// An array of tables, [[KEY]]: makes room for as many as there are, then visits each by its place.
  virtual void tables(const Key& key,
                      std::size_t count,
                      const std::function<void(std::size_t)>& make_room,
                      const std::function<void(Fields&, std::size_t)>& visit) = 0;
  virtual void text(const Key& key, std::string& value) = 0;
  /// Relative to the file it stands in, absolute once read; empty means none.
  virtual void path(const Key& key, std::filesystem::path& value) = 0;
  virtual void flag(const Key& key, bool& value) = 0;
  virtual void integer(const Key& key, std::int64_t& value, Range range) = 0;
  virtual void quantity(const Key& key, double& value, Unit unit, Range range) = 0;
  /// A list of `count` numbers, or of any number when count is 0.
  virtual void quantities(
      const Key& key, std::vector<double>& values, std::size_t count, Unit unit, Range range) = 0;
  /// The same of whole numbers.
  virtual void integers(const Key& key,
                        std::vector<std::int64_t>& values,
                        std::size_t count,
                        Range range) = 0;
  /// One of the names; `index` is its place.
  virtual void choice(const Key& key,
                      std::size_t& index,
                      std::span<const std::string_view> names) = 0;
  /// What several keys must satisfy together; a problem is reported where `key` stands, or where
  /// its table begins.
  /// `expected` completes "KEY: ...".
  virtual void check(bool holds, std::string_view key, const std::string& expected) = 0;

  /// Whether values are filled in, and not printed.
  virtual bool is_reading() const = 0;
  /// Whether nothing was wrong in this table up to here, so that its values are those of the file.
  virtual bool is_sound() const = 0;

  // The same for the types that options have.
  template <class T, class Visitor>
  void list(const Key& key, std::vector<T>& items, const Visitor& visitor) {
    tables(
        key,
        items.size(),
        [&](std::size_t count) { items.assign(count, T{}); },
        [&](Fields& fields, std::size_t k) { visitor(fields, items[k]); });
  }
  void number(const Key& key, double& value, Range range = {}) {
    quantity(key, value, Unit::kPlain, range);
  }
  void length_mm(const Key& key, double& value, Range range = Range::above(0.0)) {
    quantity(key, value, Unit::kLength, range);
  }
  /// "2 %" is 0.02.
  void share(const Key& key, double& value, Range range = Range::between(0.0, 1.0)) {
    quantity(key, value, Unit::kShare, range);
  }
  template <class Integer>
  void whole(const Key& key, Integer& value, Range range) {
    auto wide = static_cast<std::int64_t>(value);
    integer(key, wide, range);
    value = static_cast<Integer>(wide);
  }
  template <class Rep, class Period>
  void duration(const Key& key,
                std::chrono::duration<Rep, Period>& value,
                Range seconds = kDurations) {
    using Duration = std::chrono::duration<Rep, Period>;
    const double before = std::chrono::duration<double>(value).count();
    double after = before;
    quantity(key, after, Unit::kTime, seconds);
    if (after != before) value = std::chrono::round<Duration>(std::chrono::duration<double>(after));
  }
  template <class Integer, std::size_t N>
  void wholes(const Key& key, std::array<Integer, N>& values, Range range) {
    std::vector<std::int64_t> list(values.begin(), values.end());
    integers(key, list, N, range);
    for (std::size_t i = 0; i < N; ++i) values[i] = static_cast<Integer>(list[i]);
  }
  template <std::size_t N>
  void numbers(const Key& key,
               std::array<double, N>& values,
               Range range = {},
               Unit unit = Unit::kPlain) {
    std::vector<double> list(values.begin(), values.end());
    quantities(key, list, N, unit, range);
    for (std::size_t i = 0; i < N; ++i) values[i] = list[i];
  }
  /// An enumeration whose values are 0, 1, 2, ... in the order of the names.
  template <class Enum, std::size_t N>
  void one_of(const Key& key, Enum& value, const std::array<std::string_view, N>& names) {
    auto index = static_cast<std::size_t>(value);
    choice(key, index, names);
    value = static_cast<Enum>(index);
  }
};

}  // namespace opaline::config
