#include "tests/support/dng_file.h"

#include <algorithm>
#include <string_view>

namespace opaline::support {
namespace {

using Bytes = std::vector<std::byte>;

class Writer {
 public:
  explicit Writer(bool big_endian) : big_endian_(big_endian) {}
  Bytes number(std::uint32_t value, std::size_t size) const {
    Bytes bytes(size);
    for (std::size_t i = 0; i < size; ++i)
      bytes[big_endian_ ? size - 1 - i : i] = static_cast<std::byte>(value >> (8 * i) & 0xFFU);
    return bytes;
  }

 private:
  bool big_endian_;
};

void append(Bytes& to, const Bytes& bytes) { to.insert(to.end(), bytes.begin(), bytes.end()); }

struct Entry {
  std::uint16_t tag;
  std::uint16_t type;  // 1 byte, 2 text, 3 short, 4 long, 5 two longs, 10 the same with signs
  std::vector<std::uint32_t> values;
};

Entry text(std::uint16_t tag, std::string_view words) {
  Entry entry{tag, 2, {}};
  for (const char c : words) entry.values.push_back(static_cast<unsigned char>(c));
  entry.values.push_back(0);
  return entry;
}

std::size_t size_of(std::uint16_t type) { return type <= 2 ? 1 : type == 3 ? 2 : 4; }

/// A directory that is to lie at `place`, with the values that do not fit into it behind it.
Bytes directory(const Writer& writer, std::vector<Entry> entries, std::size_t place) {
  std::ranges::sort(entries, {}, &Entry::tag);
  Bytes table = writer.number(static_cast<std::uint32_t>(entries.size()), 2);
  Bytes behind;
  const std::size_t end = place + 2 + 12 * entries.size() + 4;
  for (const Entry& entry : entries) {
    Bytes values;
    for (const std::uint32_t value : entry.values)
      append(values, writer.number(value, size_of(entry.type)));
    const bool pairs = entry.type == 5 || entry.type == 10;
    const std::size_t count = pairs ? entry.values.size() / 2 : entry.values.size();
    append(table, writer.number(entry.tag, 2));
    append(table, writer.number(entry.type, 2));
    append(table, writer.number(static_cast<std::uint32_t>(count), 4));
    if (values.size() <= 4) {
      values.resize(4);
      append(table, values);
      continue;
    }
    append(table, writer.number(static_cast<std::uint32_t>(end + behind.size()), 4));
    append(behind, values);
    if (behind.size() % 2 != 0) behind.emplace_back();
  }
  append(table, writer.number(0, 4));
  append(table, behind);
  return table;
}

std::vector<Entry> picture_entries(const DngOptions& o, std::uint32_t pixels_at) {
  const auto bytes = static_cast<std::uint32_t>(2 * o.codes.size());
  const std::uint32_t samples = o.linear_raw ? 3 : 1;
  const auto width = static_cast<std::uint32_t>(o.width);
  const auto height = static_cast<std::uint32_t>(o.height);
  std::vector<Entry> entries{{254, 4, {0}},
                             {256, 4, {width}},
                             {257, 4, {height}},
                             {258, 3, std::vector<std::uint32_t>(samples, 16)},
                             {259, 3, {1}},
                             {262, 3, {o.linear_raw ? 34892U : 32803U}},
                             {273, 4, {pixels_at}},
                             {277, 3, {samples}},
                             {278, 4, {height}},
                             {279, 4, {bytes}},
                             {284, 3, {1}},
                             {50714, 4, std::vector<std::uint32_t>(samples, 64)},
                             {50717, 4, std::vector<std::uint32_t>(samples, 4095)}};
  if (!o.linear_raw) {
    entries.push_back({33421, 3, {2, 2}});
    entries.push_back({33422, 1, {o.pattern[0], o.pattern[1], o.pattern[2], o.pattern[3]}});
    entries.push_back({50710, 1, {0, 1, 2}});
    entries.push_back({50711, 3, {1}});
  }
  if (o.active != std::array<std::uint32_t, 4>{})
    entries.push_back({50829, 4, {o.active.begin(), o.active.end()}});
  return entries;
}

std::vector<Entry> camera_entries(const DngOptions& o) {
  return {text(271, "Opaline"),
          text(272, "for tests"),
          {274, 3, {o.orientation}},
          {50706, 1, {1, 4, 0, 0}},
          {50707, 1, {1, 1, 0, 0}},
          text(50708, "Opaline for tests"),
          {50721, 10, {1, 1, 0, 1, 0, 1, 0, 1, 1, 1, 0, 1, 0, 1, 0, 1, 1, 1}},
          {50728, 5, {1, 2, 1, 1, 3, 4}},
          {50778, 3, {21}}};
}

}  // namespace

std::vector<std::byte> make_dng(const DngOptions& o) {
  const Writer writer(o.big_endian);
  constexpr std::uint32_t kSize = 2;  // of the picture to look at
  std::vector<Entry> small{{254, 4, {1}},
                           {256, 4, {kSize}},
                           {257, 4, {kSize}},
                           {258, 3, {8, 8, 8}},
                           {259, 3, {1}},
                           {262, 3, {2}},
                           {273, 4, {0}},
                           {277, 3, {3}},
                           {278, 4, {kSize}},
                           {279, 4, {3 * kSize * kSize}},
                           {284, 3, {1}},
                           {330, 4, {0}}};
  const auto join = [](std::vector<Entry> a, const std::vector<Entry>& b) {
    a.insert(a.end(), b.begin(), b.end());
    return a;
  };
  const auto value = [](std::vector<Entry>& entries, std::uint16_t tag) -> std::uint32_t& {
    return std::ranges::find(entries, tag, &Entry::tag)->values[0];
  };
  Bytes file;
  for (const char c : std::string_view(o.big_endian ? "MM" : "II"))
    file.push_back(static_cast<std::byte>(c));
  append(file, writer.number(42, 2));
  append(file, writer.number(8, 4));
  if (o.behind_preview) {
    std::vector<Entry> first = join(small, camera_entries(o));
    const std::size_t length = directory(writer, first, 8).size();
    const auto shown_at = static_cast<std::uint32_t>(8 + length);
    const std::uint32_t raw_at = shown_at + 3 * kSize * kSize;
    value(first, 273) = shown_at;
    value(first, 330) = raw_at;
    append(file, directory(writer, first, 8));
    file.resize(raw_at, std::byte{128});
  }
  const std::size_t at = file.size();
  const auto entries = [&](std::uint32_t pixels_at) {
    auto picture = picture_entries(o, pixels_at);
    return o.behind_preview ? picture : join(std::move(picture), camera_entries(o));
  };
  const std::size_t length = directory(writer, entries(0), at).size();
  append(file, directory(writer, entries(static_cast<std::uint32_t>(at + length)), at));
  for (const std::uint16_t code : o.codes) append(file, writer.number(code, 2));
  return file;
}

}  // namespace opaline::support
