#include "drivers/replay/replay_index.h"

#define TOML_EXCEPTIONS 0
#include <fmt/format.h>

#include <toml++/toml.h>
#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <limits>
#include <optional>
#include <string_view>
#include <utility>

#include "base/files.h"

namespace opaline::drivers {
namespace {

constexpr double kLongestSeconds = 1e5;

/// Reads the keys of one table and keeps the first thing that is wrong.
class TableReader {
 public:
  TableReader(std::string file, const toml::table& table, std::string name)
      : file_(std::move(file)), table_(table), name_(std::move(name)) {}

  void known(std::initializer_list<std::string_view> keys) {
    for (const auto& [key, node] : table_) {
      const auto* end = keys.end();
      if (std::find(keys.begin(), end, key.str()) == end) {
        fail(node, fmt::format("unknown key \"{}\" in {}", key.str(), name_));
      }
    }
  }
  void text(std::string_view key, std::string& value) {
    if (const toml::node* node = table_.get(key)) {
      if (!node->is_string()) return fail(*node, fmt::format("{}: expected a text", key));
      value = node->value_or(std::string());
    }
  }
  void number(std::string_view key, double& value, double low, double high, bool required = false) {
    const toml::node* node = table_.get(key);
    if (node == nullptr) {
      if (required) fail(table_, fmt::format("{} without {}", name_, key));
      return;
    }
    const std::optional<double> given = node->is_number() ? node->value<double>() : std::nullopt;
    if (!given || !(*given >= low && *given <= high)) {
      return fail(*node, fmt::format("{}: expected a number from {} to {}", key, low, high));
    }
    value = *given;
  }
  void whole(std::string_view key, auto& value, double low, double high, bool required = false) {
    double number_value = static_cast<double>(value);
    number(key, number_value, low, high, required);
    if (number_value != std::floor(number_value))
      fail(*table_.get(key), fmt::format("{}: expected a whole number", key));
    value = static_cast<std::remove_reference_t<decltype(value)>>(number_value);
  }
  void time(std::string_view key,
            std::chrono::nanoseconds& value,
            double seconds_each,
            bool required = false) {
    double given = static_cast<double>(value.count()) / (1e9 * seconds_each);
    number(key, given, 1e-9 / seconds_each, kLongestSeconds, required);
    value = std::chrono::nanoseconds(std::llround(given * 1e9 * seconds_each));
  }
  void fail(const toml::node& node, const std::string& what) {
    if (!result_) return;
    result_ = invalid_argument(fmt::format(
        "{}:{}:{}: {}", file_, node.source().begin.line, node.source().begin.column, what));
  }
  Result<void> result() const { return result_; }

 private:
  std::string file_;
  const toml::table& table_;
  std::string name_;
  Result<void> result_ = ok();
};

Result<void> read_camera(const std::string& file, const toml::table& table, ReplayIndex& index) {
  TableReader reader(file, table, "[camera]");
  reader.known({"model", "width", "height", "bit_depth", "codes_per_unit"});
  reader.text("model", index.model);
  reader.whole("width", index.width, 1, 65536, true);
  reader.whole("height", index.height, 1, 65536, true);
  reader.whole("bit_depth", index.bit_depth, 8, 16);
  reader.number("codes_per_unit", index.codes_per_unit, 1e-12, 1e12);
  return reader.result();
}

Result<void> read_projector(const std::string& file, const toml::table& table, ReplayIndex& index) {
  TableReader reader(file, table, "[projector]");
  reader.known({"width", "height", "frame_period_ms", "latency_ms"});
  reader.whole("width", index.projector_width, 1, 65536);
  reader.whole("height", index.projector_height, 1, 65536);
  reader.time("frame_period_ms", index.frame_period, 1e-3);
  reader.time("latency_ms", index.latency, 1e-3);
  return reader.result();
}

Result<Photograph> read_photograph(const std::string& file, const toml::table& table) {
  TableReader reader(file, table, "[[photograph]]");
  reader.known({"file", "pattern_id", "pattern", "exposure_s", "sha256"});
  Photograph photograph;
  reader.text("file", photograph.file);
  reader.text("pattern", photograph.pattern);
  if (table.contains("pattern_id"))
    reader.whole("pattern_id", photograph.pattern_id.emplace(), 0, 0x1p53);
  if (!photograph.pattern_id && photograph.pattern.empty()) {
    reader.fail(table, "[[photograph]] without pattern or pattern_id");
  }
  reader.time("exposure_s", photograph.exposure, 1.0, true);
  reader.text("sha256", photograph.sha256);
  const std::filesystem::path name(photograph.file);
  if (photograph.file.empty() || name.is_absolute() || name.filename() != name) {
    reader.fail(table, "file: expected the name of a photograph in the folder");
  }
  if (auto good = reader.result(); !good) return good.error();
  return photograph;
}

Result<ReplayIndex> read_tables(const std::string& file, const toml::table& root) {
  ReplayIndex index;
  TableReader reader(file, root, "the index");
  reader.known({"camera", "projector", "photograph"});
  if (auto good = reader.result(); !good) return good.error();
  const toml::table* camera = root["camera"].as_table();
  if (camera == nullptr) return invalid_argument(fmt::format("{}: no [camera]", file));
  if (auto good = read_camera(file, *camera, index); !good) return good.error();
  if (const toml::table* projector = root["projector"].as_table()) {
    if (auto good = read_projector(file, *projector, index); !good) return good.error();
  }
  const toml::array* photographs = root["photograph"].as_array();
  if (photographs == nullptr || photographs->empty()) {
    return invalid_argument(fmt::format("{}: no [[photograph]]", file));
  }
  for (const toml::node& node : *photographs) {
    const toml::table* table = node.as_table();
    if (table == nullptr) return invalid_argument(fmt::format("{}: expected [[photograph]]", file));
    auto photograph = read_photograph(file, *table);
    if (!photograph) return photograph.error();
    index.photographs.push_back(*std::move(photograph));
  }
  return index;
}

}  // namespace

Result<ReplayIndex> read_replay_index(const std::filesystem::path& folder) {
  const std::filesystem::path file = folder / "index.toml";
  const auto text = read_text(file);
  if (!text) return text.error();
  const toml::parse_result parsed = toml::parse(*text, file.string());
  if (!parsed) {
    const auto& where = parsed.error().source().begin;
    return invalid_argument(fmt::format(
        "{}:{}:{}: {}", file.string(), where.line, where.column, parsed.error().description()));
  }
  return read_tables(file.string(), parsed.table());
}

}  // namespace opaline::drivers
