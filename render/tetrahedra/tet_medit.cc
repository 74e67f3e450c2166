#include <algorithm>

#include "render/tetrahedra/tet_formats.h"

namespace opaline::render {
namespace {

Result<void> read_medit_vertices(TextScanner& scanner, std::size_t bytes, TetMesh& mesh) {
  const auto count = next_count(scanner, "vertices", bytes);
  if (!count) return count.error();
  for (long v = 0; v < *count; ++v) {
    const auto point = scanner.next_point();
    if (!point) return point.error();
    mesh.vertices.push_back(*point);
    scanner.skip_words();  // a reference
  }
  return ok();
}

/// The tetrahedron that names the highest vertex: vertices may come later in the file.
struct Highest {
  int vertex = -1;
  int line = 0;
};

Result<void> read_medit_tets(TextScanner& scanner,
                             std::size_t bytes,
                             TetMesh& mesh,
                             Highest& highest) {
  const auto count = next_count(scanner, "tetrahedra", bytes);
  if (!count) return count.error();
  for (long t = 0; t < *count; ++t) {
    const auto tet = next_tet(scanner, 1);
    if (!tet) return tet.error();
    if (*std::ranges::min_element(*tet) < 0) {
      return invalid_argument(fmt::format("line {}: a vertex number below 1", scanner.line()));
    }
    const int most = *std::ranges::max_element(*tet);
    if (most > highest.vertex) highest = {most, scanner.line()};
    mesh.tets.push_back(*tet);
    scanner.skip_words();
  }
  return ok();
}

}  // namespace

Result<TetMesh> decode_medit(std::string_view text) {
  TextScanner scanner(text);
  TetMesh mesh;
  Highest highest;
  for (auto word = scanner.next_word(); !word.empty() && word != "End";
       word = scanner.next_word()) {
    Result<void> read = ok();
    if (word == "Vertices") read = read_medit_vertices(scanner, text.size(), mesh);
    if (word == "Tetrahedra") read = read_medit_tets(scanner, text.size(), mesh, highest);
    if (!read) return read.error();
  }
  if (highest.vertex >= static_cast<int>(mesh.vertices.size())) {
    return invalid_argument(fmt::format(
        "line {}: names vertex {} of {}", highest.line, highest.vertex + 1, mesh.vertices.size()));
  }
  return mesh;
}

}  // namespace opaline::render
