#pragma once

#include <filesystem>
#include <string_view>

#include "render/tetrahedra/tet_mesh.h"

namespace opaline::render {

/// Whether a file's name says that it holds tetrahedra: .mesh, .msh or .vtk.
bool is_tet_file(const std::filesystem::path& path);

/// Tetrahedra from text files, by the name's ending; whatever else they hold is passed over:
///
///   .mesh   Medit: Vertices, Tetrahedra
///   .msh    Gmsh 2.2 and 4.1: $Nodes, $Elements of type 4
///   .vtk    legacy VTK up to 4.2, unstructured grid: POINTS, CELLS, CELL_TYPES 10
///
/// A tetrahedron that is told the other way round is turned. Lengths as in the file.
/// Errors: kNotFound; kInvalidArgument with the line for what is not understood, binary files, another ending, and for what
///         validate() refuses.
Result<TetMesh> read_tets(const std::filesystem::path& path);
/// The same of a text; `format` is mesh, msh or vtk.
Result<TetMesh> decode_tets(std::string_view format, std::string_view text);

}  // namespace opaline::render
