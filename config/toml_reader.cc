#define TOML_EXCEPTIONS 0
#define TOML_ENABLE_FORMATTERS 0
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <toml++/toml.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <tuple>

#include "config/quantity.h"
#include "config/toml.h"

namespace opaline::config {
namespace {

std::string_view kind_of(const toml::node& node) {
  switch (node.type()) {
    case toml::node_type::table:
      return "a table";
    case toml::node_type::array:
      return "a list";
    case toml::node_type::string:
      return "a text";
    case toml::node_type::integer:
      return "a whole number";
    case toml::node_type::floating_point:
      return "a number";
    case toml::node_type::boolean:
      return "true or false";
    default:
      return "a date or time";
  }
}

/// A value as it stands in the file, for messages.
std::string shown(const toml::node& node) {
  if (const auto* text = node.as_string()) return fmt::format("\"{}\"", text->get());
  if (const auto* number = node.as_integer()) return fmt::format("{}", number->get());
  if (const auto* number = node.as_floating_point()) return fmt::format("{}", number->get());
  if (const auto* flag = node.as_boolean()) return flag->get() ? "true" : "false";
  return std::string(kind_of(node));
}

struct UnknownKey {
  std::string table;
  std::string key;
  toml::source_position where;
};

/// What one reading of a document collects.
struct Findings {
  const Source& source;
  std::vector<Problem> problems{};
  std::vector<UnknownKey> unknown{};
  std::map<std::string, std::set<std::string, std::less<>>> known{};  ///< keys by table

  void add(toml::source_position where, std::string message, std::string table) {
    problems.push_back({source.file,
                        static_cast<int>(where.line),
                        static_cast<int>(where.column),
                        std::move(message),
                        std::move(table)});
  }
};

class Reader : public Fields {
 public:
  Reader(Findings& findings, const toml::table& table, std::string name)
      : findings_(findings),
        table_(table),
        name_(std::move(name)),
        problems_before_(findings.problems.size()) {}

  void table(const Key& key, const Visit& visit) override {
    const std::string name =
        name_.empty() ? std::string(key.name) : fmt::format("{}.{}", name_, key.name);
    const toml::node* node = find(key);
    const toml::table* found = node != nullptr ? node->as_table() : nullptr;
    if (node != nullptr && found == nullptr) wrong(key, *node, fmt::format("a table [{}]", name));
    const toml::table empty;
    Reader inner(findings_, found != nullptr ? *found : empty, name);
    inner.missing_ = found == nullptr;
    visit(inner);
    inner.finish();
  }

  void tables(const Key& key,
              std::size_t /*count*/,
              const std::function<void(std::size_t)>& make_room,
              const std::function<void(Fields&, std::size_t)>& visit) override {
    const toml::node* node = find(key);
    if (node == nullptr) return;
    const toml::array* found = node->as_array();
    const std::string name =
        name_.empty() ? std::string(key.name) : fmt::format("{}.{}", name_, key.name);
    if (found == nullptr || !found->is_homogeneous(toml::node_type::table)) {
      return wrong(key, *node, fmt::format("tables, each headed [[{}]]", name));
    }
    make_room(found->size());
    for (std::size_t k = 0; k < found->size(); ++k) {
      Reader inner(findings_, *(*found)[k].as_table(), fmt::format("{} {}", name, k + 1));
      visit(inner, k);
      inner.finish();
    }
  }

  void text(const Key& key, std::string& value) override {
    if (const toml::node* node = find(key)) {
      if (const auto* found = node->as_string()) {
        value = found->get();
      } else {
        wrong(key, *node, "a text in quotes");
      }
    }
  }

  void path(const Key& key, std::filesystem::path& value) override {
    std::string text;
    this->text(key, text);
    if (text.empty()) return;
    value = text;
    if (value.is_absolute()) return;
    if (findings_.source.directory.empty()) {
      wrong(key, *find(key), "an absolute path, since this text is not read from a file");
      return;
    }
    value = (findings_.source.directory / value).lexically_normal();
  }

  void flag(const Key& key, bool& value) override {
    if (const toml::node* node = find(key)) {
      if (const auto* found = node->as_boolean()) {
        value = found->get();
      } else {
        wrong(key, *node, "true or false");
      }
    }
  }

  void integer(const Key& key, std::int64_t& value, Range range) override {
    const toml::node* node = find(key);
    if (node == nullptr) return;
    const auto* found = node->as_integer();
    if (found == nullptr || !contains(range, static_cast<double>(found->get()))) {
      wrong(key, *node, with_range("a whole number", range, Unit::kPlain));
    } else {
      value = found->get();
    }
  }

  void quantity(const Key& key, double& value, Unit unit, Range range) override {
    const toml::node* node = find(key);
    if (node == nullptr) return;
    if (const auto number = number_in(*node, unit); !number || !contains(range, *number)) {
      wrong(key, *node, with_range(describe(unit), range, unit));
    } else {
      value = *number;
    }
  }

  void quantities(const Key& key,
                  std::vector<double>& values,
                  std::size_t count,
                  Unit unit,
                  Range range) override {
    const std::string each = with_range(describe(unit), range, unit);
    list<double>(key, values, count, each, [&](const toml::node& element) {
      const auto number = number_in(element, unit);
      return number && contains(range, *number) ? number : std::nullopt;
    });
  }

  void integers(const Key& key,
                std::vector<std::int64_t>& values,
                std::size_t count,
                Range range) override {
    const std::string each = with_range("a whole number", range, Unit::kPlain);
    list<std::int64_t>(
        key, values, count, each, [&](const toml::node& element) -> std::optional<std::int64_t> {
          const auto* number = element.as_integer();
          if (number == nullptr || !contains(range, static_cast<double>(number->get()))) return {};
          return number->get();
        });
  }

  bool is_reading() const override { return true; }

  bool is_sound() const override {
    const auto& known = findings_.known[name_];
    return findings_.problems.size() == problems_before_ &&
           std::all_of(table_.begin(), table_.end(), [&](const auto& entry) {
             return known.contains(entry.first.str());
           });
  }

  void choice(const Key& key,
              std::size_t& index,
              std::span<const std::string_view> names) override {
    const toml::node* node = find(key);
    if (node == nullptr) return;
    const auto* text = node->as_string();
    const auto found =
        text == nullptr ? names.end() : std::find(names.begin(), names.end(), text->get());
    if (found == names.end()) {
      wrong(key, *node, fmt::format("one of \"{}\"", fmt::join(names, "\", \"")));
    } else {
      index = static_cast<std::size_t>(found - names.begin());
    }
  }

  void check(bool holds, std::string_view key, const std::string& expected) override {
    if (holds) return;
    const toml::node* node = table_.get(key);
    findings_.add(node != nullptr ? node->source().begin : table_.source().begin,
                  fmt::format("{}: {}", key, expected),
                  name_);
  }

  /// Call after the visit: what nobody asked for is unknown.
  void finish() {
    for (const auto& [key, node] : table_) {
      if (!findings_.known[name_].contains(key.str())) {
        findings_.unknown.push_back({name_, std::string(key.str()), key.source().begin});
      }
    }
  }

 private:
  /// Reads a list, each element through `take`.
  template <class T, class Take>
  void list(const Key& key,
            std::vector<T>& values,
            std::size_t count,
            const std::string& each,
            Take take) {
    const toml::node* node = find(key);
    if (node == nullptr) return;
    const toml::array* elements = node->as_array();
    if (elements == nullptr || (count != 0 && elements->size() != count)) {
      const std::string found =
          elements == nullptr ? shown(*node) : fmt::format("a list of {}", elements->size());
      const std::string length = count == 0 ? "" : fmt::format(" of {}", count);
      findings_.add(
          node->source().begin,
          fmt::format("{} is {}; expected a list{}, each {}", key.name, found, length, each),
          name_);
      return;
    }
    std::vector<T> read;
    for (const toml::node& element : *elements) {
      const std::optional<T> value = take(element);
      if (!value) return wrong(key, element, each);
      read.push_back(*value);
    }
    values = std::move(read);
  }

  const toml::node* find(const Key& key) {
    findings_.known[name_].insert(std::string(key.name));
    const toml::node* node = table_.get(key.name);
    if (node == nullptr && key.required) {
      findings_.add(missing_ ? toml::source_position{} : table_.source().begin,
                    fmt::format("missing key \"{}\"{}: {}",
                                key.name,
                                name_.empty() ? "" : fmt::format(" in [{}]", name_),
                                key.help),
                    name_);
    }
    return node;
  }

  void wrong(const Key& key, const toml::node& node, const std::string& expected) {
    findings_.add(node.source().begin,
                  fmt::format("{} is {}; expected {}", key.name, shown(node), expected),
                  name_);
  }

  static std::optional<double> number_in(const toml::node& node, Unit unit) {
    if (const auto* text = node.as_string(); text != nullptr && unit != Unit::kPlain) {
      return parse_quantity(text->get(), unit);
    }
    const auto number = node.value<double>();
    if (unit != Unit::kPlain || node.is_boolean() || !number || !std::isfinite(*number)) {
      return std::nullopt;
    }
    return number;
  }

  static std::string with_range(std::string_view what, const Range& range, Unit unit) {
    const std::string limits = describe(range, unit);
    return limits.empty() ? std::string(what) : fmt::format("{}, {}", what, limits);
  }

  Findings& findings_;
  const toml::table& table_;
  std::string name_;
  std::size_t problems_before_;
  bool missing_ = false;
};

/// The key it was probably meant to be, or the table it belongs into.
std::string suggestion(const Findings& findings, const UnknownKey& unknown) {
  const auto& siblings = findings.known.at(unknown.table);
  const std::vector<std::string_view> names(siblings.begin(), siblings.end());
  if (const auto name = nearest(unknown.key, names)) {
    return fmt::format("did you mean \"{}\"?", *name);
  }
  for (const auto& [table, keys] : findings.known) {
    if (keys.contains(unknown.key)) {
      return table.empty() ? "it belongs at the top of the file, before the tables"
                           : fmt::format("it belongs in [{}]", table);
    }
  }
  return fmt::format("known here: {}", fmt::join(names, ", "));
}

std::vector<Problem> sorted(Findings findings) {
  for (const UnknownKey& unknown : findings.unknown) {
    findings.add(unknown.where,
                 fmt::format("unknown key \"{}\"{}; {}",
                             unknown.key,
                             unknown.table.empty() ? "" : fmt::format(" in [{}]", unknown.table),
                             suggestion(findings, unknown)),
                 unknown.table);
  }
  std::stable_sort(
      findings.problems.begin(), findings.problems.end(), [](const Problem& a, const Problem& b) {
        return std::tie(a.line, a.column) < std::tie(b.line, b.column);
      });
  return std::move(findings.problems);
}

}  // namespace

std::string to_string(const Problem& problem) {
  if (problem.line == 0) return fmt::format("{}: {}", problem.file, problem.message);
  return fmt::format("{}:{}:{}: {}", problem.file, problem.line, problem.column, problem.message);
}

std::string to_string(const std::vector<Problem>& problems) {
  std::string text;
  for (const Problem& problem : problems) {
    if (!text.empty()) text += '\n';
    text += to_string(problem);
  }
  return text;
}

bool is_sound(const std::vector<Problem>& problems, std::string_view table) {
  return std::none_of(problems.begin(), problems.end(), [&](const Problem& problem) {
    const std::string_view place = problem.table;
    const std::string_view outer = place.size() < table.size() ? place : table;
    const std::string_view inner = place.size() < table.size() ? table : place;
    const bool within =
        inner.starts_with(outer) && (inner.size() == outer.size() || inner[outer.size()] == '.');
    return place.empty() || within;
  });
}

std::vector<Problem> read_toml(const Source& source, const Fields::Visit& visit) {
  const toml::parse_result parsed = toml::parse(source.text, source.file);
  Findings findings{source};
  if (parsed.failed()) {
    findings.add(parsed.error().source().begin, std::string(parsed.error().description()), "");
    return findings.problems;
  }
  Reader reader(findings, parsed.table(), "");
  visit(reader);
  reader.finish();
  return sorted(std::move(findings));
}

std::vector<std::string> top_level_keys(const Source& source) {
  const toml::parse_result parsed = toml::parse(source.text);
  std::vector<std::string> keys;
  if (parsed.failed()) return keys;
  for (const auto& [key, node] : parsed.table()) keys.emplace_back(key.str());
  return keys;
}

}  // namespace opaline::config
