#pragma once

#include <filesystem>
#include <stop_token>
#include <string_view>

#include "base/result.h"
#include "render/mesh/triangle_mesh.h"

namespace opaline::render {

/// Reads a surface; the format follows from the name's ending, in any case:
///
///   .obj  Wavefront: v and f (also "7/1/2" and negative indices); everything else is passed over
///   .off  Geomview's object file format, text: OFF, with or without the word
///   .ply  Stanford polygons: text, binary of either byte order; vertex x y z, face vertex_indices
///   .stl  stereolithography: text or binary; corners at the same place become one vertex
///
/// Polygons are cut into fans. Coordinates are multiplied by `millimetres`, the length of the file's unit.
/// Errors: kNotFound; kInvalidArgument, with file and line (or, in binary files, the element), for what is damaged, names
///         vertices that are not there, has no triangles, or more than kMostTriangles; kCancelled.
inline constexpr std::size_t kMostTriangles = 20'000'000;
Result<TriangleMesh> read_mesh(const std::filesystem::path& path,
                               double millimetres = 1.0,
                               const std::stop_token& stop = {});

/// The same from memory; formats by name: "obj", "off", "ply", "stl".
Result<TriangleMesh> decode_mesh(std::string_view format,
                                 std::string_view bytes,
                                 const std::stop_token& stop = {});

}  // namespace opaline::render
