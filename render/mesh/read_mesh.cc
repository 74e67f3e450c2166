#include "render/mesh/read_mesh.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <string>

#include "base/files.h"
#include "render/mesh/mesh_formats.h"

namespace opaline::render {
namespace {

constexpr std::size_t kLargestFile = std::size_t{2} << 30;

std::string format_of(const std::filesystem::path& path) {
  std::string ending = path.extension().string();
  std::ranges::transform(
      ending, ending.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return ending.empty() ? ending : ending.substr(1);
}

Result<TriangleMesh> decode(std::string_view format,
                            std::string_view bytes,
                            const std::stop_token& stop) {
  if (format == "obj") return decode_obj(bytes, stop);
  if (format == "off") return decode_off(bytes, stop);
  if (format == "ply") return decode_ply(bytes, stop);
  if (format == "stl") return decode_stl(bytes, stop);
  return invalid_argument(
      fmt::format("\"{}\" is no mesh format; there are obj, off, ply, stl", format));
}

}  // namespace

Result<TriangleMesh> decode_mesh(std::string_view format,
                                 std::string_view bytes,
                                 const std::stop_token& stop) {
  auto mesh = decode(format, bytes, stop);
  if (!mesh) return mesh.error();
  if (mesh->triangles.size() > kMostTriangles) {
    return invalid_argument(
        fmt::format("{} triangles; at most {} are read: decimate the mesh first",
                    mesh->triangles.size(),
                    kMostTriangles));
  }
  if (auto valid = validate(*mesh); !valid) return valid.error();
  return mesh;
}

Result<TriangleMesh> read_mesh(const std::filesystem::path& path,
                               double millimetres,
                               const std::stop_token& stop) {
  if (!(millimetres > 0.0) || !std::isfinite(millimetres)) {
    return invalid_argument(fmt::format("a unit of {} mm; expected > 0", millimetres));
  }
  const auto bytes = read_text(path, kLargestFile);
  if (!bytes) return bytes.error();
  auto mesh = decode_mesh(format_of(path), *bytes, stop);
  if (!mesh) return mesh.error().in(path.string());
  for (Vec3& p : mesh->vertices) p = p * millimetres;
  return mesh;
}

}  // namespace opaline::render
