#include <fmt/format.h>

#include <vector>

#include "render/mesh/mesh_formats.h"
#include "render/mesh/text_scanner.h"

namespace opaline::render {
namespace {

struct Counts {
  long vertices = 0;
  long faces = 0;
};

Result<Counts> read_counts(TextScanner& scanner, std::size_t bytes) {
  std::string_view word = scanner.next_word();
  if (word == "OFF") word = scanner.next_word();
  const auto vertices = TextScanner::to_number<long>(word);
  if (!vertices) return scanner.expected("OFF, or the number of vertices", word);
  const auto faces = scanner.next_number<long>("the number of faces");
  if (!faces) return faces.error();
  const auto edges = scanner.next_number<long>("the number of edges");
  if (!edges) return edges.error();
  const auto room = static_cast<long>(bytes / 6);  // "0 0 0\n" is the shortest vertex
  if (*vertices < 0 || *faces < 0 || *vertices > room || *faces > room) {
    return invalid_argument(
        fmt::format("line {}: {} vertices and {} faces do not fit into {} bytes",
                    scanner.line(),
                    *vertices,
                    *faces,
                    bytes));
  }
  return Counts{*vertices, *faces};
}

Result<void> read_face(TextScanner& scanner, std::vector<int>& corners, TriangleMesh& mesh) {
  const auto count = scanner.next_number<int>("how many corners a face has");
  if (!count) return count.error();
  if (*count < 1 || *count > 1'000'000)
    return scanner.expected("how many corners a face has", std::to_string(*count));
  corners.clear();
  for (int k = 0; k < *count; ++k) {
    const auto corner = scanner.next_number<int>("a vertex number");
    if (!corner) return corner.error();
    corners.push_back(*corner);
  }
  scanner.skip_words();  // a colour may follow
  add_polygon(mesh, corners);
  return ok();
}

}  // namespace

Result<TriangleMesh> decode_off(std::string_view text, const std::stop_token& stop) {
  TextScanner scanner(text);
  const auto counts = read_counts(scanner, text.size());
  if (!counts) return counts.error();
  TriangleMesh mesh;
  mesh.vertices.reserve(counts->vertices);
  for (long v = 0; v < counts->vertices; ++v) {
    if (stopped_at(static_cast<std::size_t>(v), stop)) return cancelled("reading the mesh");
    const auto point = scanner.next_point();
    if (!point) return point.error();
    mesh.vertices.push_back(*point);
  }
  std::vector<int> corners;
  for (long f = 0; f < counts->faces; ++f) {
    if (stopped_at(static_cast<std::size_t>(f), stop)) return cancelled("reading the mesh");
    if (auto read = read_face(scanner, corners, mesh); !read) return read.error();
  }
  return mesh;
}

}  // namespace opaline::render
