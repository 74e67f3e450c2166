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

Result<void> read_medit_tets(TextScanner& scanner, std::size_t bytes, TetMesh& mesh) {
  const auto count = next_count(scanner, "tetrahedra", bytes);
  if (!count) return count.error();
  for (long t = 0; t < *count; ++t) {
    const auto tet = next_tet(scanner, 1);
    if (!tet) return tet.error();
    mesh.tets.push_back(*tet);
    scanner.skip_words();
  }
  return ok();
}

}  // namespace

Result<TetMesh> decode_medit(std::string_view text) {
  TextScanner scanner(text);
  TetMesh mesh;
  for (auto word = scanner.next_word(); !word.empty() && word != "End";
       word = scanner.next_word()) {
    Result<void> read = ok();
    if (word == "Vertices") read = read_medit_vertices(scanner, text.size(), mesh);
    if (word == "Tetrahedra") read = read_medit_tets(scanner, text.size(), mesh);
    if (!read) return read.error();
  }
  return mesh;
}

}  // namespace opaline::render
