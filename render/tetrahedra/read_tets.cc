#include "render/tetrahedra/read_tets.h"

#include <algorithm>
#include <cctype>
#include <string>

#include "base/files.h"
#include "render/tetrahedra/tet_formats.h"

namespace opaline::render {
namespace {

constexpr std::size_t kLargestTetFile = std::size_t{2} << 30;

std::string tet_format_of(const std::filesystem::path& path) {
  std::string ending = path.extension().string();
  std::ranges::transform(
      ending, ending.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return ending.empty() ? ending : ending.substr(1);
}

bool corners_exist(const TetMesh& mesh, const std::array<int, 4>& tet) {
  const auto count = static_cast<int>(mesh.vertices.size());
  return std::ranges::all_of(tet, [count](int v) { return v >= 0 && v < count; });
}

void turn_inverted(TetMesh& mesh) {
  for (std::size_t t = 0; t < mesh.tets.size(); ++t) {
    if (corners_exist(mesh, mesh.tets[t]) && volume_of(mesh, t) < 0.0) {
      std::swap(mesh.tets[t][2], mesh.tets[t][3]);
    }
  }
}

}  // namespace

bool is_tet_file(const std::filesystem::path& path) {
  const std::string format = tet_format_of(path);
  return format == "mesh" || format == "msh" || format == "vtk";
}

Result<TetMesh> decode_tets(std::string_view format, std::string_view text) {
  Result<TetMesh> mesh = invalid_argument(
      fmt::format("\"{}\" is no format of tetrahedra; there are mesh, msh, vtk", format));
  if (format == "mesh") mesh = decode_medit(text);
  if (format == "msh") mesh = decode_gmsh(text);
  if (format == "vtk") mesh = decode_vtk(text);
  if (!mesh) return mesh.error();
  turn_inverted(*mesh);
  if (auto valid = validate(*mesh); !valid) return valid.error();
  return mesh;
}

Result<TetMesh> read_tets(const std::filesystem::path& path) {
  const auto text = read_text(path, kLargestTetFile);
  if (!text) return text.error();
  auto mesh = decode_tets(tet_format_of(path), *text);
  if (!mesh) return mesh.error().in(path.string());
  return mesh;
}

}  // namespace opaline::render
