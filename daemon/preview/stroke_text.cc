#include "daemon/preview/stroke_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <string_view>

#include "daemon/preview/json_numbers.h"

namespace opaline::daemon {
namespace {

enum class Kind : std::uint8_t { kWord, kNumber, kThree };
struct Key {
  std::string_view name;
  Kind kind;
};
constexpr std::array<Key, 11> kKeys{{{"operation", Kind::kWord},
                                     {"quantity", Kind::kWord},
                                     {"reach", Kind::kWord},
                                     {"value", Kind::kThree},
                                     {"direction", Kind::kThree},
                                     {"strength", Kind::kNumber},
                                     {"softness", Kind::kNumber},
                                     {"centre_mm", Kind::kThree},
                                     {"radius_mm", Kind::kNumber},
                                     {"depth_mm", Kind::kNumber},
                                     {"thickness_mm", Kind::kNumber}}};
constexpr std::string_view kMillimetres = "_mm";
constexpr std::size_t kLongestWord = 32;

bool is_word(const nlohmann::json& value) {
  if (!value.is_string()) return false;
  const auto& word = value.get_ref<const std::string&>();
  return !word.empty() && word.size() <= kLongestWord &&
         std::ranges::all_of(word, [](char c) { return (c >= 'a' && c <= 'z') || c == '_'; });
}

std::string number(const nlohmann::json& value, bool is_length) {
  return is_length ? fmt::format("\"{:.9g} mm\"", value.get<double>())
                   : fmt::format("{:.9g}", value.get<double>());
}

Result<std::string> value_text(const Key& key, const nlohmann::json& value) {
  const bool is_length = key.name.ends_with(kMillimetres);
  if (key.kind == Kind::kWord) {
    if (is_word(value)) return fmt::format("\"{}\"", value.get<std::string>());
    return invalid_argument(fmt::format("\"{}\": expected a word", key.name));
  }
  if (key.kind == Kind::kNumber) {
    if (is_finite_number(value)) return number(value, is_length);
    return invalid_argument(fmt::format("\"{}\": expected a number", key.name));
  }
  if (!is_three_numbers(value))
    return invalid_argument(fmt::format("\"{}\": expected three numbers", key.name));
  return fmt::format("[{}, {}, {}]",
                     number(value[0], is_length),
                     number(value[1], is_length),
                     number(value[2], is_length));
}

}  // namespace

Result<std::string> stroke_text(const nlohmann::json& stroke) {
  if (!stroke.is_object()) return invalid_argument("a stroke is a JSON object");
  std::string text = "\n[[objects.edits]]\n";
  for (const auto& [name, value] : stroke.items()) {
    const auto* key = std::ranges::find(kKeys, std::string_view(name), &Key::name);
    if (key == kKeys.end())
      return invalid_argument(fmt::format("\"{}\": no key of a stroke (docs/api.md)", name));
    const auto written = value_text(*key, value);
    if (!written) return written.error();
    const bool is_length = key->name.ends_with(kMillimetres);
    text +=
        fmt::format("{} = {}\n",
                    key->name.substr(0, key->name.size() - (is_length ? kMillimetres.size() : 0)),
                    *written);
  }
  return text;
}

}  // namespace opaline::daemon
