#pragma once

#include <fmt/format.h>

#include "render/mesh/text_scanner.h"
#include "render/tetrahedra/tet_mesh.h"

namespace opaline::render {

/// One decoder a format; decode_tets() checks what they answer.
Result<TetMesh> decode_medit(std::string_view text);
Result<TetMesh> decode_gmsh(std::string_view text);
Result<TetMesh> decode_vtk(std::string_view text);

/// A count that the text has room for.
inline Result<long> next_count(TextScanner& scanner, std::string_view what, std::size_t bytes) {
  const auto count = scanner.next_number<long>(what);
  if (!count) return count.error();
  if (*count < 0 || *count > static_cast<long>(bytes)) {
    return invalid_argument(fmt::format(
        "line {}: {} {} do not fit into {} bytes", scanner.line(), *count, what, bytes));
  }
  return *count;
}

/// Four vertex numbers, counted from `first`.
inline Result<std::array<int, 4>> next_tet(TextScanner& scanner, int first) {
  std::array<int, 4> tet{};
  for (int& corner : tet) {
    const auto number = scanner.next_number<int>("a vertex number");
    if (!number) return number.error();
    corner = *number - first;
  }
  return tet;
}

}  // namespace opaline::render
