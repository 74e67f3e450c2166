#pragma once

#include <charconv>
#include <cstddef>
#include <optional>
#include <string_view>
#include <utility>

#include "base/pose.h"
#include "base/result.h"

namespace opaline::render {

/// Takes a text apart by lines and by words, and knows where it is.
class TextScanner {
 public:
  explicit TextScanner(std::string_view text) : rest_(text) {}

  int line() const { return line_; }  ///< of the last word or line, from 1

  /// The next line without its end; nothing at the end of the text.
  std::optional<std::string_view> next_line() {
    if (rest_.empty()) return std::nullopt;
    const std::size_t end = rest_.find('\n');
    std::string_view found = rest_.substr(0, end);
    rest_.remove_prefix(end == std::string_view::npos ? rest_.size() : end + 1);
    ++line_;
    if (found.ends_with('\r')) found.remove_suffix(1);
    return found;
  }

  /// The next word of any line, after comments from # on; empty at the end of the text.
  std::string_view next_word() {
    std::string_view found = word_of(words_);
    while (found.empty()) {
      const auto next = next_line();
      if (!next) return {};
      words_ = next->substr(0, next->find('#'));
      found = word_of(words_);
    }
    return found;
  }

  /// Forgets what is left of the line of the last word.
  void skip_words() { words_ = {}; }

  template <class Number>
  Result<Number> next_number(std::string_view what) {
    const std::string_view found = next_word();
    const std::optional<Number> value = to_number<Number>(found);
    if (!value) return expected(what, found);
    return *value;
  }

  Result<Vec3> next_point() {
    const auto x = next_number<double>("a coordinate");
    if (!x) return x.error();
    const auto y = next_number<double>("a coordinate");
    if (!y) return y.error();
    const auto z = next_number<double>("a coordinate");
    if (!z) return z.error();
    return Vec3{*x, *y, *z};
  }

  /// "line 7: expected a number, found "x""
  Error expected(std::string_view what, std::string_view found) const;

  /// What is left of the text after the last line.
  std::string_view rest() const { return rest_; }

  /// Cuts the first word off a line.
  static std::string_view word_of(std::string_view& line) {
    const std::size_t begin = line.find_first_not_of(" \t\r");
    if (begin == std::string_view::npos) return {};
    line.remove_prefix(begin);
    const std::string_view found = line.substr(0, line.find_first_of(" \t\r"));
    line.remove_prefix(found.size());
    return found;
  }

  /// The whole word as a number, or nothing.
  template <class Number>
  static std::optional<Number> to_number(std::string_view word) {
    if (word.starts_with('+')) word.remove_prefix(1);
    Number value{};
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    if (error != std::errc{} || end != word.data() + word.size()) return std::nullopt;
    return value;
  }

 private:
  std::string_view rest_;
  std::string_view words_;
  int line_ = 0;
};

}  // namespace opaline::render
