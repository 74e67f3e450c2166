#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cstdint>
#include <cstring>
#include <string>
#include <vector>

#include "render/mesh/mesh_formats.h"
#include "render/mesh/text_scanner.h"

namespace opaline::render {
namespace {

enum class Encoding : std::uint8_t { kText, kLittleEndian, kBigEndian };
enum class Type : std::uint8_t { kInt8, kUint8, kInt16, kUint16, kInt32, kUint32, kFloat, kDouble };

struct Property {
  std::string name;
  Type type = Type::kFloat;
  bool is_list = false;
  Type count_type = Type::kUint8;
};

struct Element {
  std::string name;
  std::size_t count = 0;
  std::vector<Property> properties;
  int line = 0;  // of the header
};

struct Header {
  Encoding encoding = Encoding::kText;
  std::vector<Element> elements;
};

Result<Type> parse_type(std::string_view word, const TextScanner& scanner) {
  if (word == "char" || word == "int8") return Type::kInt8;
  if (word == "uchar" || word == "uint8") return Type::kUint8;
  if (word == "short" || word == "int16") return Type::kInt16;
  if (word == "ushort" || word == "uint16") return Type::kUint16;
  if (word == "int" || word == "int32") return Type::kInt32;
  if (word == "uint" || word == "uint32") return Type::kUint32;
  if (word == "float" || word == "float32") return Type::kFloat;
  if (word == "double" || word == "float64") return Type::kDouble;
  return scanner.expected("a PLY type", word);
}

std::size_t size_of(Type type) {
  constexpr std::size_t sizes[]{1, 1, 2, 2, 4, 4, 4, 8};
  return sizes[static_cast<std::size_t>(type)];
}

Result<Property> parse_property(std::string_view words, const TextScanner& scanner) {
  Property property;
  std::string_view word = TextScanner::word_of(words);
  property.is_list = word == "list";
  if (property.is_list) {
    const auto count_type = parse_type(TextScanner::word_of(words), scanner);
    if (!count_type) return count_type.error();
    property.count_type = *count_type;
    word = TextScanner::word_of(words);
  }
  const auto type = parse_type(word, scanner);
  if (!type) return type.error();
  property.type = *type;
  property.name = TextScanner::word_of(words);
  return property;
}

Result<void> parse_header_line(std::string_view words, const TextScanner& scanner, Header& header) {
  const std::string_view keyword = TextScanner::word_of(words);
  if (keyword == "format") {
    const std::string_view name = TextScanner::word_of(words);
    if (name == "binary_little_endian")
      header.encoding = Encoding::kLittleEndian;
    else if (name == "binary_big_endian")
      header.encoding = Encoding::kBigEndian;
    else if (name != "ascii")
      return scanner.expected("ascii or binary_..._endian", name);
  } else if (keyword == "element") {
    const std::string_view name = TextScanner::word_of(words);
    const std::string_view number = TextScanner::word_of(words);
    const auto count = TextScanner::to_number<std::size_t>(number);
    if (!count) return scanner.expected("how many elements", number);
    header.elements.push_back({std::string(name), *count, {}, scanner.line()});
  } else if (keyword == "property") {
    if (header.elements.empty())
      return scanner.expected("an element before its property", "property");
    auto property = parse_property(words, scanner);
    if (!property) return property.error();
    header.elements.back().properties.push_back(*std::move(property));
  }
  return ok();
}

bool is_corner_list(const Property& property) {
  return property.is_list && (property.name == "vertex_indices" || property.name == "vertex_index");
}

Result<void> check_properties(const Element& element) {
  const auto lacks = [&](std::string_view what) {
    return invalid_argument(
        fmt::format("line {}: element {} has no property {}", element.line, element.name, what));
  };
  for (const std::string_view axis : {"x", "y", "z"}) {
    const bool known = std::ranges::any_of(
        element.properties, [&](const Property& p) { return p.name == axis && !p.is_list; });
    if (element.name == "vertex" && !known) return lacks(axis);
  }
  if (element.name == "face" && std::ranges::none_of(element.properties, is_corner_list)) {
    return lacks("list vertex_indices");
  }
  return ok();
}

Result<Header> parse_header(TextScanner& scanner) {
  Header header;
  const auto magic = scanner.next_line();
  if (!magic || *magic != "ply") return scanner.expected("ply", magic.value_or(""));
  while (const auto line = scanner.next_line()) {
    if (*line == "end_header") {
      for (const Element& element : header.elements) {
        if (auto checked = check_properties(element); !checked) return checked.error();
      }
      return header;
    }
    if (auto parsed = parse_header_line(*line, scanner, header); !parsed) return parsed.error();
  }
  return scanner.expected("end_header", "");
}

/// Hands out one number after another, whatever the encoding; remembers when they ran out. As text each element has a line of
/// its own.
class Numbers {
 public:
  Numbers(TextScanner scanner, Encoding encoding)
      : scanner_(scanner), encoding_(encoding), bytes_(scanner.rest()) {}

  double next(Type type) { return encoding_ == Encoding::kText ? next_text() : next_binary(type); }
  bool failed() const { return failed_; }
  void begin_element() {
    while (encoding_ == Encoding::kText && words_.find_first_not_of(" \t\r") == words_.npos) {
      const auto line = scanner_.next_line();
      if (!line) return;
      words_ = line->substr(0, line->find('#'));
    }
  }
  /// Whether the element's line says more.
  bool has_more() const { return words_.find_first_not_of(" \t\r") != words_.npos; }
  std::size_t bytes_left() const {
    return encoding_ == Encoding::kText ? words_.size() : bytes_.size();
  }
  std::string where() const {
    return encoding_ == Encoding::kText ? fmt::format("line {}: ", scanner_.line()) : std::string();
  }

 private:
  double next_text() {
    const auto value = TextScanner::to_number<double>(TextScanner::word_of(words_));
    failed_ = failed_ || !value;
    return value.value_or(0.0);
  }

  template <class T>
  double take() {
    unsigned char raw[sizeof(T)];
    std::memcpy(raw, bytes_.data(), sizeof raw);
    bytes_.remove_prefix(sizeof raw);
    if ((encoding_ == Encoding::kBigEndian) == (std::endian::native == std::endian::little)) {
      std::reverse(raw, raw + sizeof raw);
    }
    T value{};
    std::memcpy(&value, raw, sizeof value);
    return static_cast<double>(value);
  }

  double next_binary(Type type) {
    failed_ = failed_ || bytes_.size() < size_of(type);
    if (failed_) return 0.0;
    switch (type) {
      case Type::kInt8:
        return take<std::int8_t>();
      case Type::kUint8:
        return take<std::uint8_t>();
      case Type::kInt16:
        return take<std::int16_t>();
      case Type::kUint16:
        return take<std::uint16_t>();
      case Type::kInt32:
        return take<std::int32_t>();
      case Type::kUint32:
        return take<std::uint32_t>();
      case Type::kFloat:
        return take<float>();
      case Type::kDouble:
        return take<double>();
    }
    return 0.0;
  }

  TextScanner scanner_;
  Encoding encoding_;
  std::string_view bytes_;
  std::string_view words_;  // what is left of an element's line
  bool failed_ = false;
};

/// Reads one element into the mesh; false when the numbers make no sense.
bool read_element(const Element& element,
                  Numbers& numbers,
                  std::vector<int>& corners,
                  TriangleMesh& mesh) {
  Vec3 point;
  numbers.begin_element();
  for (const Property& property : element.properties) {
    if (property.is_list) {
      const double count = numbers.next(property.count_type);
      if (!(count >= 0.0) || count > static_cast<double>(numbers.bytes_left())) return false;
      corners.clear();
      for (int k = 0; k < static_cast<int>(count); ++k) {
        const double index = numbers.next(property.type);
        if (is_corner_list(property))
          corners.push_back(index >= 0.0 && index < 2e9 ? static_cast<int>(index) : -1);
      }
      if (element.name == "face" && is_corner_list(property)) add_polygon(mesh, corners);
      continue;
    }
    const double value = numbers.next(property.type);
    if (property.name == "x") point.x = value;
    if (property.name == "y") point.y = value;
    if (property.name == "z") point.z = value;
  }
  if (element.name == "vertex") mesh.vertices.push_back(point);
  return !numbers.failed() && !numbers.has_more();
}

}  // namespace

Result<TriangleMesh> decode_ply(std::string_view bytes, const std::stop_token& stop) {
  TextScanner scanner(bytes);
  const auto header = parse_header(scanner);
  if (!header) return header.error();
  Numbers numbers(scanner, header->encoding);
  TriangleMesh mesh;
  std::vector<int> corners;
  for (const Element& element : header->elements) {
    if (element.properties.empty()) continue;
    for (std::size_t i = 0; i < element.count; ++i) {
      if (stopped_at(i, stop)) return cancelled("reading the mesh");
      if (!read_element(element, numbers, corners, mesh)) {
        return invalid_argument(
            fmt::format("{}{} {} of {} is damaged or cut off{}",
                        numbers.where(),
                        element.name,
                        i,
                        element.count,
                        numbers.has_more() ? ": more numbers than properties" : ""));
      }
    }
  }
  return mesh;
}

}  // namespace opaline::render
