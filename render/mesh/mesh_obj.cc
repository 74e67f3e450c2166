#include <fmt/format.h>

#include <algorithm>
#include <vector>

#include "render/mesh/mesh_formats.h"
#include "render/mesh/read_mesh.h"
#include "render/mesh/text_scanner.h"

namespace opaline::render {
namespace {

Result<Vec3> parse_vertex(std::string_view words, const TextScanner& scanner) {
  Vec3 p;
  for (double* x : {&p.x, &p.y, &p.z}) {
    const std::string_view word = TextScanner::word_of(words);
    const auto value = TextScanner::to_number<double>(word);
    if (!value) return scanner.expected("a coordinate", word);
    *x = *value;
  }
  return p;
}

/// "7", "7/1", "7//3", "-1": counted from 1, or back from the last vertex so far.
Result<int> parse_corner(std::string_view word, std::size_t vertices, const TextScanner& scanner) {
  const auto index = TextScanner::to_number<long>(word.substr(0, word.find('/')));
  if (!index || *index == 0) return scanner.expected("a vertex number", word);
  const long from_zero = *index > 0 ? *index - 1 : static_cast<long>(vertices) + *index;
  if (from_zero < 0 || from_zero >= static_cast<long>(kMostTriangles) * 3) {
    return scanner.expected("the number of a vertex", word);
  }
  return static_cast<int>(from_zero);
}

Result<void> add_face(std::string_view words,
                      const TextScanner& scanner,
                      std::vector<int>& corners,
                      TriangleMesh& mesh) {
  corners.clear();
  for (std::string_view word = TextScanner::word_of(words); !word.empty();
       word = TextScanner::word_of(words)) {
    const auto corner = parse_corner(word, mesh.vertices.size(), scanner);
    if (!corner) return corner.error();
    corners.push_back(*corner);
  }
  if (corners.size() < 3) return scanner.expected("three vertices or more", "");
  add_polygon(mesh, corners);
  return ok();
}

}  // namespace

Result<TriangleMesh> decode_obj(std::string_view text, const std::stop_token& stop) {
  TriangleMesh mesh;
  TextScanner scanner(text);
  std::vector<int> corners;
  int highest = -1;  // vertex that a face names, and in which line
  int highest_line = 0;
  while (auto line = scanner.next_line()) {
    if (stopped_at(static_cast<std::size_t>(scanner.line()), stop))
      return cancelled("reading the mesh");
    std::string_view words = line->substr(0, line->find('#'));
    const std::string_view keyword = TextScanner::word_of(words);
    if (keyword == "v") {
      const auto vertex = parse_vertex(words, scanner);
      if (!vertex) return vertex.error();
      mesh.vertices.push_back(*vertex);
    } else if (keyword == "f") {
      if (auto added = add_face(words, scanner, corners, mesh); !added) return added.error();
      const int most = *std::ranges::max_element(corners);
      if (most > highest) highest_line = scanner.line();
      highest = std::max(highest, most);
    }
  }
  if (highest >= static_cast<int>(mesh.vertices.size())) {
    return invalid_argument(fmt::format(
        "line {}: names vertex {} of {}", highest_line, highest + 1, mesh.vertices.size()));
  }
  return mesh;
}

}  // namespace opaline::render
