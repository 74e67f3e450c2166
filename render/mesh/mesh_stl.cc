#include <fmt/format.h>

#include <array>
#include <cstdint>
#include <cstring>

#include "render/mesh/mesh_formats.h"
#include "render/mesh/read_mesh.h"
#include "render/mesh/text_scanner.h"

namespace opaline::render {
namespace {

constexpr std::size_t kHeader = 84;  // 80 bytes of anything, the number of triangles
constexpr std::size_t kRecord = 50;  // normal, three corners (float32), two bytes of anything

std::uint32_t triangle_count(std::string_view bytes) {
  std::uint32_t count = 0;
  if (bytes.size() >= kHeader) std::memcpy(&count, bytes.data() + 80, sizeof count);
  return count;
}

bool is_text(std::string_view bytes) {
  const bool printable = bytes.substr(0, 512).find('\0') == std::string_view::npos;
  const std::size_t binary_size = kHeader + kRecord * std::size_t{triangle_count(bytes)};
  return bytes.starts_with("solid") && printable && bytes.size() != binary_size;
}

void add_triangle(TriangleMesh& mesh) {
  const auto n = static_cast<int>(mesh.vertices.size());
  mesh.triangles.push_back({n - 3, n - 2, n - 1});
}

Result<TriangleMesh> decode_binary(std::string_view bytes, const std::stop_token& stop) {
  const std::size_t count = triangle_count(bytes);
  if (bytes.size() < kHeader)
    return invalid_argument("ends within the header of a binary STL file");
  if (bytes.size() < kHeader + kRecord * count) {
    return invalid_argument(
        fmt::format("ends at triangle {} of {}", (bytes.size() - kHeader) / kRecord, count));
  }
  TriangleMesh mesh;
  if (count > kMostTriangles)
    return invalid_argument(fmt::format("{} triangles; at most {}", count, kMostTriangles));
  mesh.vertices.reserve(3 * count);
  mesh.triangles.reserve(count);
  for (std::size_t t = 0; t < count; ++t) {
    if (stopped_at(t, stop)) return cancelled("reading the mesh");
    std::array<std::array<float, 3>, 3> corners{};
    std::memcpy(corners.data(), bytes.data() + kHeader + kRecord * t + 12, sizeof corners);
    for (const auto& [x, y, z] : corners) mesh.vertices.push_back({x, y, z});
    add_triangle(mesh);
  }
  return mesh;
}

Result<TriangleMesh> decode_text(std::string_view text, const std::stop_token& stop) {
  TriangleMesh mesh;
  TextScanner scanner(text);
  while (auto line = scanner.next_line()) {
    if (stopped_at(static_cast<std::size_t>(scanner.line()), stop))
      return cancelled("reading the mesh");
    std::string_view words = *line;
    if (TextScanner::word_of(words) != "vertex") continue;
    Vec3 p;
    for (double* x : {&p.x, &p.y, &p.z}) {
      const std::string_view word = TextScanner::word_of(words);
      const auto value = TextScanner::to_number<double>(word);
      if (!value) return scanner.expected("a coordinate", word);
      *x = *value;
    }
    mesh.vertices.push_back(p);
    if (mesh.vertices.size() % 3 == 0) add_triangle(mesh);
  }
  if (mesh.vertices.size() % 3 != 0) return scanner.expected("three corners a facet", "");
  return mesh;
}

}  // namespace

Result<TriangleMesh> decode_stl(std::string_view bytes, const std::stop_token& stop) {
  auto mesh = is_text(bytes) ? decode_text(bytes, stop) : decode_binary(bytes, stop);
  if (!mesh) return mesh.error();
  TriangleMesh welded = weld(*mesh, stop);
  if (stop.stop_requested()) return cancelled("reading the mesh");
  return welded;
}

}  // namespace opaline::render
