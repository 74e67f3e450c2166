#pragma once

#include <span>
#include <string_view>

#include "base/result.h"
#include "render/mesh/triangle_mesh.h"

namespace opaline::render {

/// One decoder a format; read_mesh() checks what they answer. Each refuses, before it reserves memory, counts that the
/// bytes cannot hold.
Result<TriangleMesh> decode_obj(std::string_view text);
Result<TriangleMesh> decode_off(std::string_view text);
Result<TriangleMesh> decode_ply(std::string_view bytes);
Result<TriangleMesh> decode_stl(std::string_view bytes);

/// Adds a polygon as a fan from its first corner; fewer than three corners add nothing.
inline void add_polygon(TriangleMesh& mesh, std::span<const int> corners) {
  for (std::size_t k = 2; k < corners.size(); ++k) {
    mesh.triangles.push_back({corners[0], corners[k - 1], corners[k]});
  }
}

}  // namespace opaline::render
