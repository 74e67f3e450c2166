#pragma once

#include <span>
#include <stop_token>
#include <string_view>

#include "base/result.h"
#include "render/mesh/triangle_mesh.h"

namespace opaline::render {

/// Whether long work over many things shall stop: looks at the token at one thing in 65536.
inline bool stopped_at(std::size_t i, const std::stop_token& stop) {
  return i % 65536 == 0 && stop.stop_requested();
}

/// One decoder a format; read_mesh() checks what they answer. Each refuses, before it reserves memory, counts that the
/// bytes cannot hold, and answers kCancelled soon after it is asked to stop.
Result<TriangleMesh> decode_obj(std::string_view text, const std::stop_token& stop);
Result<TriangleMesh> decode_off(std::string_view text, const std::stop_token& stop);
Result<TriangleMesh> decode_ply(std::string_view bytes, const std::stop_token& stop);
Result<TriangleMesh> decode_stl(std::string_view bytes, const std::stop_token& stop);

/// Adds a polygon as a fan from its first corner; fewer than three corners add nothing.
inline void add_polygon(TriangleMesh& mesh, std::span<const int> corners) {
  for (std::size_t k = 2; k < corners.size(); ++k) {
    mesh.triangles.push_back({corners[0], corners[k - 1], corners[k]});
  }
}

}  // namespace opaline::render
