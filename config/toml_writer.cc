#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cmath>
#include <utility>

#include "config/quantity.h"
#include "config/toml.h"

namespace opaline::config {
namespace {

/// A TOML basic string.
std::string toml_string(std::string_view text) {
  std::string out = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') {
      out += '\\';
      out += c;
    } else if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f) {
      out += fmt::format("\\u{:04X}", static_cast<unsigned>(static_cast<unsigned char>(c)));
    } else {
      out += c;
    }
  }
  return out + '"';
}

std::string toml_number(double value, Unit unit) {
  if (unit != Unit::kPlain) return toml_string(format_quantity(value, unit));
  std::string text = fmt::format("{}", value);
  if (text.find_first_of(".en") == std::string::npos) text += ".0";
  return text;
}

/// Prints a table's own keys first, then its sub-tables, as TOML wants them.
class Writer : public Fields {
 public:
  Writer(std::string name, bool help, bool one_of_many = false)
      : name_(std::move(name)), help_(help), one_of_many_(one_of_many) {}

  void table(const Key& key, const Visit& visit) override {
    Writer inner(name_.empty() ? std::string(key.name) : fmt::format("{}.{}", name_, key.name),
                 help_);
    visit(inner);
    tables_ += inner.document(help_ ? key.help : "");
  }
  void tables(const Key& key,
              std::size_t count,
              const std::function<void(std::size_t)>& /*make_room*/,
              const std::function<void(Fields&, std::size_t)>& visit) override {
    for (std::size_t k = 0; k < count; ++k) {
      Writer inner(name_.empty() ? std::string(key.name) : fmt::format("{}.{}", name_, key.name),
                   help_,
                   /*one_of_many=*/true);
      visit(inner, k);
      tables_ += inner.document(help_ && k == 0 ? key.help : "");
    }
  }
  void text(const Key& key, std::string& value) override { line(key, toml_string(value)); }
  void path(const Key& key, std::filesystem::path& value) override {
    line(key, toml_string(value.string()));
  }
  void flag(const Key& key, bool& value) override { line(key, value ? "true" : "false"); }
  void integer(const Key& key, std::int64_t& value, Range /*range*/) override {
    line(key, fmt::format("{}", value));
  }
  void quantity(const Key& key, double& value, Unit unit, Range /*range*/) override {
    line(key, toml_number(value, unit));
  }
  void quantities(const Key& key,
                  std::vector<double>& values,
                  std::size_t /*count*/,
                  Unit unit,
                  Range /*range*/) override {
    std::vector<std::string> texts;
    texts.reserve(values.size());
    for (const double value : values) texts.push_back(toml_number(value, unit));
    line(key, fmt::format("[{}]", fmt::join(texts, ", ")));
  }
  void integers(const Key& key,
                std::vector<std::int64_t>& values,
                std::size_t /*count*/,
                Range /*range*/) override {
    line(key, fmt::format("[{}]", fmt::join(values, ", ")));
  }
  bool is_reading() const override { return false; }
  bool is_sound() const override { return true; }
  void choice(const Key& key,
              std::size_t& index,
              std::span<const std::string_view> names) override {
    std::string help(key.help);
    help += fmt::format("{}{}", help.empty() ? "" : ": ", fmt::join(names, " | "));
    line({key.name, help}, toml_string(names[index]));
  }
  void check(bool /*holds*/, std::string_view /*key*/, const std::string& /*expected*/) override {}

  std::string document(std::string_view help) const {
    std::string out;
    if (!help.empty()) out += fmt::format("\n# {}", help);
    if (one_of_many_) {
      out += fmt::format("\n[[{}]]\n", name_);
    } else if (!name_.empty() && (!keys_.empty() || !help.empty())) {
      out += fmt::format("\n[{}]\n", name_);
    }
    return out + keys_ + tables_;
  }

 private:
  void line(const Key& key, const std::string& value) {
    std::string text = fmt::format("{} = {}", key.name, value);
    if (help_ && !key.help.empty()) {
      const std::string beside = fmt::format("{:<40}  # {}", text, key.help);
      text = beside.size() <= 100 ? beside : fmt::format("# {}\n{}", key.help, text);
    }
    keys_ += text + "\n";
  }

  std::string name_;
  bool help_;
  bool one_of_many_;
  std::string keys_;
  std::string tables_;
};

}  // namespace

std::string write_toml(const Fields::Visit& visit, bool help) {
  Writer writer("", help);
  visit(writer);
  return writer.document("");
}

}  // namespace opaline::config
