#include <vector>

#include "render/tetrahedra/tet_formats.h"

namespace opaline::render {
namespace {

constexpr int kVtkTetrahedron = 10;

struct VtkCells {
  std::vector<std::vector<int>> corners;
  std::vector<int> types;
};

Result<void> read_vtk_points(TextScanner& scanner, std::size_t bytes, TetMesh& mesh) {
  const auto count = next_count(scanner, "points", bytes);
  if (!count) return count.error();
  scanner.next_word();  // float or double
  for (long v = 0; v < *count; ++v) {
    const auto point = scanner.next_point();
    if (!point) return point.error();
    mesh.vertices.push_back(*point);
  }
  return ok();
}

Result<void> read_vtk_cells(TextScanner& scanner, std::size_t bytes, VtkCells& cells) {
  const auto count = next_count(scanner, "cells", bytes);
  if (!count) return count.error();
  const auto numbers = next_count(scanner, "numbers of cells", bytes);
  if (!numbers) return numbers.error();
  for (long c = 0; c < *count; ++c) {
    const auto corners = scanner.next_number<int>(
        "how many corners a cell has (VTK 5 writes OFFSETS: write the file as version 4.2)");
    if (!corners) return corners.error();
    if (*corners < 0 || *corners > *numbers) {
      return scanner.expected("how many corners a cell has", std::to_string(*corners));
    }
    std::vector<int> cell(static_cast<std::size_t>(*corners));
    for (int& corner : cell) {
      const auto number = scanner.next_number<int>("a point's number");
      if (!number) return number.error();
      corner = *number;
    }
    cells.corners.push_back(std::move(cell));
  }
  return ok();
}

Result<void> read_vtk_types(TextScanner& scanner, std::size_t bytes, VtkCells& cells) {
  const auto count = next_count(scanner, "cell types", bytes);
  if (!count) return count.error();
  for (long c = 0; c < *count; ++c) {
    const auto type = scanner.next_number<int>("a cell's type");
    if (!type) return type.error();
    cells.types.push_back(*type);
  }
  return ok();
}

}  // namespace

Result<TetMesh> decode_vtk(std::string_view text) {
  TextScanner scanner(text);
  TetMesh mesh;
  VtkCells cells;
  for (auto word = scanner.next_word(); !word.empty(); word = scanner.next_word()) {
    if (word == "BINARY") {
      return invalid_argument(
          fmt::format("line {}: a binary file; write it as ASCII", scanner.line()));
    }
    Result<void> read = ok();
    if (word == "POINTS") read = read_vtk_points(scanner, text.size(), mesh);
    if (word == "CELLS") read = read_vtk_cells(scanner, text.size(), cells);
    if (word == "CELL_TYPES") read = read_vtk_types(scanner, text.size(), cells);
    if (word == "POINT_DATA" || word == "CELL_DATA") break;
    if (!read) return read.error();
  }
  if (cells.types.size() != cells.corners.size()) {
    return invalid_argument(
        fmt::format("{} cells, and types of {} of them", cells.corners.size(), cells.types.size()));
  }
  for (std::size_t c = 0; c < cells.types.size(); ++c) {
    const auto& corners = cells.corners[c];
    if (cells.types[c] != kVtkTetrahedron) continue;
    if (corners.size() != 4) {
      return invalid_argument(
          fmt::format("cell {}: a tetrahedron of {} corners", c, corners.size()));
    }
    mesh.tets.push_back({corners[0], corners[1], corners[2], corners[3]});
  }
  return mesh;
}

}  // namespace opaline::render
