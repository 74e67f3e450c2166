#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <map>
#include <optional>
#include <string>
#include <utility>

#include "render/dipole/mesh_texels.h"

namespace opaline::render {
namespace {

/// What is left of a text, taken word by word.
class Words {
 public:
  explicit Words(std::string_view line) : left_(line) {}
  std::string_view next() {
    const auto begin = left_.find_first_not_of(" \t\r");
    if (begin == std::string_view::npos) return {};
    left_.remove_prefix(begin);
    const auto end = std::min(left_.find_first_of(" \t\r"), left_.size());
    const std::string_view word = left_.substr(0, end);
    left_.remove_prefix(end);
    return word;
  }

 private:
  std::string_view left_;
};

template <typename Number>
bool number_from(std::string_view word, Number& value) {
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  return error == std::errc{} && end == word.data() + word.size();
}

class TexturedObj {
 public:
  explicit TexturedObj(double millimetres) : millimetres_(millimetres) {}

  /// Empty, or what is wrong.
  std::string take(std::string_view line) {
    Words words(line);
    const std::string_view what = words.next();
    if (what == "v") return take_numbers(words, 3, positions_);
    if (what == "vt") return take_numbers(words, 2, coordinates_);
    if (what != "f") return {};
    std::vector<std::uint32_t> polygon;
    for (std::string_view word = words.next(); !word.empty(); word = words.next()) {
      const auto corner = corner_of(word);
      if (!corner) return fmt::format("a corner \"{}\"; expected vertex/coordinate", word);
      polygon.push_back(*corner);
    }
    if (polygon.size() < 3) return "a face of fewer than three corners";
    for (std::size_t n = 2; n < polygon.size(); ++n)
      mesh_.triangles.push_back({polygon[0], polygon[n - 1], polygon[n]});
    return {};
  }
  TexturedMesh finished() {
    std::vector<Vec3> around(positions_.size() / 3);
    for (const auto& triangle : mesh_.triangles) {
      const Vec3 a = mesh_.corners[triangle[0]].position;
      const Vec3 across =
          cross(mesh_.corners[triangle[1]].position - a, mesh_.corners[triangle[2]].position - a);
      for (const std::uint32_t corner : triangle)
        around[vertex_[corner]] = around[vertex_[corner]] + across;
    }
    for (std::size_t n = 0; n < mesh_.corners.size(); ++n)
      if (length(around[vertex_[n]]) > 0.0)
        mesh_.corners[n].normal = normalized(around[vertex_[n]]);
    return std::move(mesh_);
  }

 private:
  static std::string take_numbers(Words& words, int count, std::vector<double>& values) {
    for (int n = 0; n < count; ++n) {
      const std::string_view word = words.next();
      double value = 0.0;
      if (!number_from(word, value)) return fmt::format("\"{}\"; expected a number", word);
      values.push_back(value);
    }
    return {};
  }
  /// From 0; negative numbers count from the end.
  static std::optional<std::size_t> place_of(std::string_view word, std::size_t count) {
    std::int64_t number = 0;
    if (!number_from(word, number)) return std::nullopt;
    const std::int64_t place = number < 0 ? static_cast<std::int64_t>(count) + number : number - 1;
    if (place < 0 || place >= static_cast<std::int64_t>(count)) return std::nullopt;
    return static_cast<std::size_t>(place);
  }
  std::optional<std::uint32_t> corner_of(std::string_view word) {
    const auto slash = word.find('/');
    if (slash == std::string_view::npos) return std::nullopt;
    const std::string_view rest = word.substr(slash + 1);
    const auto vertex = place_of(word.substr(0, slash), positions_.size() / 3);
    const auto coordinate = place_of(rest.substr(0, rest.find('/')), coordinates_.size() / 2);
    if (!vertex || !coordinate) return std::nullopt;
    const auto [known, fresh] = corners_.try_emplace(
        {*vertex, *coordinate}, static_cast<std::uint32_t>(mesh_.corners.size()));
    if (fresh) {
      const double* const p = &positions_[3 * *vertex];
      const double* const t = &coordinates_[2 * *coordinate];
      mesh_.corners.push_back({Vec3{p[0], p[1], p[2]} * millimetres_, {0, 0, 1}, t[0], t[1]});
      vertex_.push_back(*vertex);
    }
    return known->second;
  }

  double millimetres_;
  std::vector<double> positions_;
  std::vector<double> coordinates_;
  std::map<std::pair<std::size_t, std::size_t>, std::uint32_t> corners_;
  std::vector<std::size_t> vertex_;  // of each corner
  TexturedMesh mesh_;
};

}  // namespace

Result<TexturedMesh> decode_textured_obj(std::string_view text, double millimetres) {
  TexturedObj obj(millimetres);
  for (int line = 1; !text.empty(); ++line) {
    const auto end = std::min(text.find('\n'), text.size());
    if (const std::string wrong = obj.take(text.substr(0, end)); !wrong.empty())
      return invalid_argument(fmt::format("line {}: {}", line, wrong));
    text.remove_prefix(std::min(text.size(), end + 1));
  }
  TexturedMesh mesh = obj.finished();
  if (mesh.triangles.empty()) return invalid_argument("no faces with texture coordinates");
  return mesh;
}

}  // namespace opaline::render
